// The commands that were run: what each said, whether it runs, and a button that stops it.

import { make } from "./shared/dom.js";
import * as server from "./server.js";

const LAST = 12, PERIOD = 500;  // jobs that are shown; time between two looks at one that runs [ms]
const known = new Map();

/** Show jobs, and follow those that run; `ended` is called after the end of one. */
export function watch(place, jobs, ended) {
  for (const [number, shown] of known) if (!jobs.some(one => one.number === number)) { shown.box.remove(); known.delete(number); }
  for (const job of jobs.slice(0, LAST).reverse()) {
    if (known.has(job.number)) continue;
    const shown = drawn(job);
    known.set(job.number, shown);
    place.prepend(shown.box);
    follow(job.number, shown, ended, job.state === "running");
  }
}

function drawn(job) {
  const state = make("span", { class: "state", role: "status" }, job.state), words = make("pre", { tabindex: "0" });
  const stop = make("button", { type: "button" }, "Stop"), copy = make("button", { type: "button" }, "Copy command");
  stop.onclick = () => server.stop(job.number);
  copy.onclick = () => navigator.clipboard?.writeText(job.command);
  const box = make("div", { class: "job" }, make("code", { class: "command" }, job.command),
    make("div", { class: "row" }, state, stop, copy), words);
  return { box, state, words, stop, read: 0 };
}

async function follow(number, shown, ended, ran) {
  try {
    const said = await server.job(number, shown.read);
    const below = shown.words.scrollTop + shown.words.clientHeight >= shown.words.scrollHeight - 8;
    shown.words.append(said.text);
    if (below) shown.words.scrollTop = shown.words.scrollHeight;
    shown.read = said.read;
    shown.state.textContent = said.state === "failed" ? `failed (${said.status})` : said.state;
    shown.state.className = `state ${said.state.split(" ")[0]}`;
    shown.stop.hidden = said.state !== "running";
    if (said.state === "running" || said.text) setTimeout(() => follow(number, shown, ended, ran), said.text ? 50 : PERIOD);
    else if (ran) ended();
  } catch (error) { shown.state.textContent = error.message; }
}
