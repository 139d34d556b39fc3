// The page of a live twin: the last picture from the server is kept, and drawn when it has changed.

import { Chart } from "./chart.js";
import { Hours, Strips } from "./strips.js";
import { colours as palette, nightly } from "./shared/canvas.js";
import { make } from "./shared/dom.js";
import { line } from "./shared/line.js";
import { clock } from "./shared/units.js";

const $ = id => document.getElementById(id);
const NAMES = ["ink", "muted", "line", "card", "water", "actual", "ordered", "other", "band"];
const colours = () => palette(NAMES);
const chart = new Chart($("chart"), colours), strips = new Strips($("misses"), colours), hours = new Hours($("hours"), colours);
const DEGREES = 180 / Math.PI, KNOT = 1852 / 3600;

let last = null, due = false;
/** State of the page, for tests. */
const seatrial = globalThis.seatrial = { pictures: 0, drawn: 0, get last() { return last; } };
const turn = nightly($("night"), () => draw());
addEventListener("keydown", event => { if (event.key.toLowerCase() === "n" && !event.ctrlKey && !event.altKey && !event.metaKey) turn(); });
new ResizeObserver(() => draw()).observe(document.querySelector("main"));

const say = line({ hear, broken() { if (!last?.over) notice("No connection to the twin; trying again…"); } });

function hear(said) {
  say({ read: said.n });
  last = said;
  head(said); alarms(said); learnt(said); trust(said);
  chart.show(said); strips.show(said); hours.show(said);
  notice(said.over ? "The log has ended; this is the last state." : said.masked.length ? `Not believed at present: ${said.masked.map(name).join(", ")}.` : "");
  draw();
  seatrial.pictures += 1;
}

function head(said) {
  const [u] = said.state.u, [v] = said.state.v_m, lasting = said.alarms.filter(one => one.over === null).length;
  $("title").textContent = `Twin of ${said.ship} on ${said.log}`;
  document.title = `${lasting ? `${lasting} alarm${lasting > 1 ? "s" : ""}: ` : ""}${said.ship}`;
  $("state").textContent = lasting ? `${lasting} alarm${lasting > 1 ? "s" : ""}` : said.over ? "ended" : "following";
  $("state").dataset.state = lasting ? "fault" : said.over ? "ended" : "following";
  $("clock").textContent = clock(said.t);
  $("speed").textContent = `${(Math.hypot(u, v) / KNOT).toFixed(2)} kn`;
  $("heading").textContent = `${(((said.state.psi[0] * DEGREES) % 360 + 360) % 360).toFixed(1)}°`;
  $("turn").textContent = `${signed(said.state.r[0] * DEGREES * 60, 1)}°/min`;
  const part = which => said.unseen.find(one => one.name === `current ${which}`);
  const north = part("north"), east = part("east");
  $("current").textContent = north && east ? `${(Math.hypot(north.value, east.value) / KNOT).toFixed(2)} kn to ${String(Math.round((Math.atan2(east.value, north.value) * DEGREES + 360) % 360)).padStart(3, "0")}°` : "–";
}

function alarms(said) {
  const causes = said.alarms.filter(one => one.of === "");
  $("calm").hidden = causes.length > 0;
  const items = causes.reverse().map(one => make("li", { "data-lasts": String(one.over === null) }, first(one.text),
    make("span", {}, `named at ${clock(one.named)}${one.over === null ? "; lasts" : one.over > one.named ? `; over at ${clock(one.over)}` : ""}`), make("span", {}, one.advice)));
  $("alarms").querySelector("ol").replaceChildren(...items);
}

function learnt(said) {
  const state = [["speed ahead", said.state.u, "m/s"], ["drift to starboard", said.state.v_m, "m/s"]].map(([what, [value, sd], unit]) => row(what, value, sd, unit));
  const unseen = said.unseen.map(one => one.unit === "rad/s" ? row(one.name, one.value * DEGREES * 60, one.sd * DEGREES * 60, "°/min") : row(one.name, one.value, one.sd, one.unit));
  const parameters = said.parameters.map(one => row(one.path, one.value, one.sd, one.unit, `${signed(100 * (one.value / one.before - 1), 1)} %`, one.about));
  $("learnt").querySelector("tbody").replaceChildren(...parameters, ...unseen, ...state);
}

const row = (what, value, sd, unit, change = "", title = null) => make("tr", { title }, make("td", {}, what),
  make("td", {}, make("b", {}, figure(value)), ` ± ${figure(sd, 2)} `, make("i", {}, unit)), make("td", {}, change));

function trust(said) {
  $("level").textContent = `${Math.round(100 * said.level)} %`;
  const rows = said.trust.map(([h, count, rms, rival, held]) => make("tr", {}, ...[h < 60 ? `${h} s` : `${h / 60} min`, count, metres(rms), metres(rival), held === null ? "–" : `${Math.round(100 * held)} %`].map(text => make("td", {}, String(text)))));
  $("trust").querySelector("tbody").replaceChildren(...rows);
}

function notice(text) {
  if ($("notice").textContent !== text) $("notice").textContent = text;
  $("notice").hidden = !text;
  $("notice").classList.toggle("calm", Boolean(last?.over));
}

const first = text => text.charAt(0).toUpperCase() + text.slice(1);
const name = channel => ({ x: "position north", y: "position east", psi: "compass", r: "rate gyro", u_w: "log", v_north: "velocity north", v_east: "velocity east" }[channel] ?? channel);
const metres = value => value === null ? "–" : `${figure(value, 3)} m`;
const signed = (value, digits) => `${value < 0 ? "−" : "+"}${Math.abs(value).toFixed(digits)}`;
const figure = (value, digits = 4) => value === null ? "–" : (Math.abs(value) > 0 && Math.abs(value) < 1e-3 ? value.toExponential(Math.max(digits - 2, 0)) : Number(value.toPrecision(digits)).toString()).replace("-", "−");

function draw() {
  if (due) return;
  due = true;
  requestAnimationFrame(() => { due = false; chart.draw(); strips.draw(); hours.draw(); seatrial.drawn += 1; });
}
