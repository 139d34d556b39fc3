// The page of a running fit: data from the server are kept, and drawn when they have changed.

import { Curves } from "./curves.js";
import { Ranges } from "./ranges.js";
import { Tracks } from "./tracks.js";
import { colours as palette } from "./shared/canvas.js";
import { palettes } from "./shared/palettes.js";
import { line } from "./shared/line.js";
import { clock } from "./shared/units.js";

const $ = id => document.getElementById(id);
const NAMES = ["ink", "muted", "line", "card", "actual", "ordered", "other"];
const colours = () => palette(NAMES);
const curves = new Curves($("curves"), colours), tracks = new Tracks($("tracks"), colours), ranges = new Ranges($("ranges"));
const RUNS = new Set(["fitting", "writing the report"]);

let over = false, down = false, last = null, came = 0, due = false;
/** State of the page, for tests. */
const seatrial = globalThis.seatrial = { pictures: 0, drawn: 0, curves, tracks, ranges, get last() { return last; } };
const turn = palettes($("palette"), () => draw());
addEventListener("keydown", event => { if (event.key.toLowerCase() === "n" && !event.ctrlKey && !event.altKey && !event.metaKey) turn(); });
new ResizeObserver(() => draw()).observe(document.querySelector("main"));

const say = line({
  hear, broken() { down = true; if (!over) notice("No connection to the fit; trying again…"); },
});

function hear(said) {
  say({ read: said.n });
  last = said; came = performance.now(); over = said.over; down = false;
  if (said.part) { curves.begin(said.part); tracks.begin(said.part); ranges.begin(said.part); }
  if (said.rows) curves.add(said.rows, said.last, said.anew);
  if (said.tracks !== undefined) tracks.show(said.tracks);
  if (said.values) ranges.show(said.values);
  $("none-yet").textContent = `No iteration yet${said.doing ? `; ${said.doing}` : ""}.`;
  head(said);
  parts(said.parts, said.part?.name);
  draw();
  seatrial.pictures += 1;
}

function head(said) {
  $("title").textContent = said.title;
  document.title = `${said.state}: ${said.title}`;
  $("state").textContent = said.state;
  $("state").dataset.state = said.state;
  const [iteration, objective, validation] = said.last ?? [null, null, null];
  $("iteration").textContent = iteration ?? "–";
  $("objective").textContent = figure(objective);
  $("validation").textContent = figure(validation);
  $("watched").hidden = validation === null;
  notice(said.state === "failed" ? `The fit failed: ${said.text}` : said.state === "stopped" ? "The run was stopped; this is its last state. The same command resumes it."
    : said.over ? `The run has ended; this is its last state. ${said.text}` : said.state === "done" ? `Done: ${said.text || "everything is written"}.` : "");
  tick();
}

let current = "";
function parts(all, begun) {
  current = begun ?? current;
  $("parts").hidden = all.length < 2;
  const count = wanted => all.filter(([, state]) => state === wanted).length, before = count("done before");
  $("parts").querySelector("h2").textContent = `${all.length} fits, ${before ? `${before} done before, ` : ""}${count("done")} done`;
  const items = all.map(([name, state]) => {
    const item = document.createElement("li"), word = document.createElement("span");
    item.textContent = name; word.textContent = state; item.dataset.state = state;
    if (name === current) item.setAttribute("aria-current", "true");
    item.append(word);
    return item;
  });
  const list = $("parts").querySelector("ol"), told = JSON.stringify([all, current]);
  if (list.dataset.told !== told) { list.replaceChildren(...items); list.dataset.told = told; }
}

function notice(text) {
  if ($("notice").textContent !== text) $("notice").textContent = text;
  $("notice").hidden = !text;
  $("notice").classList.toggle("calm", last?.state === "done");
}

function tick() {
  if (last !== null) $("clock").textContent = clock(last.elapsed + (RUNS.has(last.state) && !over && !down ? (performance.now() - came) / 1000 : 0));
}
setInterval(tick, 500);

const figure = value => value === null || value === undefined ? "–" : Number(value.toPrecision(5)).toString().replace("-", "−");

function draw() {
  if (due) return;
  due = true;
  requestAnimationFrame(() => { due = false; curves.draw(); tracks.draw(); seatrial.drawn += 1; });
}
