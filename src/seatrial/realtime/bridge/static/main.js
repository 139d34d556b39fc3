// The page: one connection, pictures twenty times a second, drawn at the rate of the display.

import { Chart } from "./chart.js";
import { Conning } from "./conning.js";
import { Helm } from "./controls.js";
import { Link, OLD } from "./link.js";
import { Panel } from "./panel.js";
import { Range } from "./range.js";
import { Strips } from "./strips.js";
import { colours as palette, nightly } from "./shared/canvas.js";

const $ = id => document.getElementById(id);
const NAMES = ["ink", "muted", "line", "water", "actual", "ordered", "ghost", "other"];
const colours = () => palette(NAMES);
const turn = nightly($("night"));

let quiet = null;
function say(text, stays = false) {
  clearTimeout(quiet);
  $("notice").textContent = text;
  $("notice").hidden = !text;
  if (!stays) quiet = setTimeout(() => { $("notice").hidden = true; }, 6000);
}

const link = new Link(), chart = new Chart($("chart"), colours), conning = new Conning($("conning"));
const strips = new Strips($("strips"), colours), panel = new Panel(link, say), range = new Range(link);
let helm = null;

link.addEventListener("hello", () => {
  const hello = link.hello, places = { rudders: $("rudders"), engines: $("engines"), thrusters: $("thrusters") };
  helm = new Helm(hello, request => link.ask(request), places);
  $("own-keys").replaceChildren(...helm.hints().flatMap(hint => [...hint, " · "]));
  for (const part of [chart, conning, strips, panel, range]) part.begin(hello);
  say("");
});
link.addEventListener("picture", () => {
  chart.keep(link.last); strips.keep(link.last); panel.show(link.last); range.show(link.last);
  document.body.classList.toggle("failed", link.last.failed !== null);
});
link.addEventListener("back", () => { chart.clear(); strips.clear(); });
link.addEventListener("lost", ({ detail: ever }) => say(ever ? "This page receives no more data; reload it to continue." : "No connection to the simulation; trying again…", true));
addEventListener("hashchange", () => location.reload());  // another key
link.addEventListener("note", event => say(event.detail));

// A button pressed with the pointer loses the focus, so that Space means midships and does not press it again.
addEventListener("click", event => { if (event.detail > 0) event.target.closest("button, summary")?.blur(); });
addEventListener("keydown", event => {
  if (event.ctrlKey || event.altKey || event.metaKey || event.target.closest("input, select, textarea")) return;
  if (event.key === " " && event.target.closest("button, summary")) return;
  const key = event.key.toLowerCase();
  if (key === "n") turn();
  else if (key === "c") chart.follow = true;
  else if (key === "p" && link.commands) panel.pause();
  else if (key === "t" && link.commands && range.take()) void 0;
  else if (key === "a" && link.commands && range.acknowledge()) void 0;
  else if (event.key === "+") chart.zoom(1.5);
  else if (event.key === "-") chart.zoom(1 / 1.5);
  else if (!(link.commands && range.manual && helm?.key(event))) return;
  event.preventDefault();
});

/** Counters of drawn pictures, for tests. */
const stats = globalThis.seatrial = { drawn: 0, link, chart };
function draw(now) {
  requestAnimationFrame(draw);
  const contact = link.contact(now);
  panel.contact(contact);
  document.body.classList.toggle("old", contact !== null && contact.age > OLD);
  const state = link.between(now);
  if (state === null || helm === null) return;
  chart.draw(state); conning.draw(state); strips.draw(now, state.t);
  helm.show(state, link.last.clipped, link.commands && range.manual);
  stats.drawn += 1;
}
requestAnimationFrame(draw);
link.open();
