// The page: one connection, pictures twenty times a second, drawn at the rate of the display.

import { Chart } from "./chart.js";
import { Conning } from "./conning.js";
import { Helm } from "./controls.js";
import { Help } from "./help.js";
import { Link, OLD } from "./link.js";
import { Panel } from "./panel.js";
import { Pilot } from "./pilot.js";
import { Range } from "./range.js";
import { Strips } from "./strips.js";
import { colours as palette } from "./shared/canvas.js";
import { dimmer, palettes } from "./shared/palettes.js";

const $ = id => document.getElementById(id);
const NAMES = ["ink", "muted", "line", "water", "actual", "ordered", "ghost", "other", "port", "starboard", "land", "shoal", "card"];
const colours = () => palette(NAMES);
const turn = palettes($("palette")), dim = dimmer($("light"));

let quiet = null;
function say(text, stays = false) {
  clearTimeout(quiet);
  $("notice").textContent = text;
  $("notice").hidden = !text;
  if (!stays) quiet = setTimeout(() => { $("notice").hidden = true; }, 6000);
}

const link = new Link(), chart = new Chart($("chart"), colours), conning = new Conning($("conning"), colours);
const strips = new Strips($("strips"), colours), panel = new Panel(link, say), range = new Range(link), pilot = new Pilot($("autopilot"), link, range);
let helm = null;

link.addEventListener("hello", () => {
  const hello = link.hello, places = { rudders: $("rudders"), engines: $("engines"), thrusters: $("thrusters") };
  helm = new Helm(hello, request => link.ask(request), places);
  help.begin(helm.hints());
  for (const part of [chart, conning, strips, panel, range, pilot]) part.begin(hello);
  document.body.classList.add("waiting");
  say("Waiting for the first data of the simulation…", true);
});
link.addEventListener("picture", () => {
  if (document.body.classList.contains("waiting")) { document.body.classList.remove("waiting"); say(""); }
  chart.keep(link.last); strips.keep(link.last); panel.show(link.last); range.show(link.last); pilot.show(link.last);
  document.body.classList.toggle("failed", link.last.failed !== null);
});
link.addEventListener("back", () => { chart.clear(); strips.clear(); });
link.addEventListener("lost", ({ detail: ever }) => say(ever ? "This page receives no more data; reload it to continue." : "No connection to the simulation; trying again…", true));
addEventListener("hashchange", () => location.reload());  // another key
link.addEventListener("note", event => say(event.detail));

// A button pressed with the pointer loses the focus, so that Space means midships and does not press it again.
addEventListener("click", event => { if (event.detail > 0) event.target.closest("button, summary")?.blur(); });

/** A key of the page: the first of `keys` and the second are opposite ways; `steers` only for the page in command. */
const key = (keys, text, does, steers = false) => ({ keys, text, does, steers });
const KEYS = [
  key(["H"], "hold the present heading, or end that", () => pilot.mode === "heading" ? pilot.manual() : pilot.hold(), true),
  key([",", "."], "heading that is held 1° to port, to starboard", way => pilot.nudge(way), true),
  key(["<", ">"], "the same by 10°", way => pilot.nudge(10 * way), true),
  key(["G"], "follow the track", () => pilot.track(), true),
  key(["T"], "take over from wire or track pilot", () => range.take(), true),
  key(["A"], "acknowledge the next alarm", () => range.acknowledge(), true),
  key(["P"], "pause, resume", () => panel.pause(), true),
  key(["O"], "north, head or course up", () => chart.view.next(chart.own)),
  key(["C"], "follow the ship", () => { chart.view.follow = true; }),
  key(["-", "+"], "zoom", way => chart.zoom(1.5 ** way)),
  key(["W", "V"], "shorter, longer velocity vectors", way => chart.vectors.turn(way)),
  key(["R"], "range rings", () => { chart.rings.shown = !chart.rings.shown; }),
  key(["E"], "bearing line and range marker (a click sets them)", () => chart.marker()),
  key(["J", "L"], "turn the bearing line by 1°", way => chart.rings.move(way, 0, chart.view)),
  key(["K", "I"], "range marker nearer, farther", way => chart.rings.move(0, 0.1 * way, chart.view)),
  key(["N"], "next palette: bright, day, dusk, night", () => turn()),
  key(["D", "B"], "dimmer, brighter", way => dim(0.1 * way)),
  key(["?"], "this list", () => help.toggle()),
];
const help = new Help($("help"), KEYS);
$("keys").onclick = () => help.toggle();

addEventListener("keydown", event => {
  if (event.ctrlKey || event.altKey || event.metaKey || event.target.closest("input:not([type=range]), select, textarea")) return;
  if (event.key === " " && event.target.closest("button, summary")) return;
  if ($("help").open && event.key !== "?") return;
  const pressed = event.key.toUpperCase(), found = KEYS.find(({ keys }) => keys.includes(pressed));
  if (found && link.last !== null) {
    if (found.steers && !link.commands) return;
    found.does(found.keys.indexOf(pressed) ? 1 : -1);
  } else if (!(link.commands && range.manual && helm?.key(event))) return;
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
  chart.draw(state, link.last.range, link.last.ahead); conning.draw(state, link.last); strips.draw(now, state.t);
  helm.show(state, link.last.clipped, link.commands && range.manual);
  stats.drawn += 1;
}
requestAnimationFrame(draw);
link.open();
