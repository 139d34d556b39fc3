// The range: who steers, alarms to acknowledge, other ships with their nearest approach, faults on buttons.

import { make } from "./shared/dom.js";
import { DEGREE, KNOT, MILE, clock, course, fixed } from "./shared/units.js";

const $ = id => document.getElementById(id);
const CALLED = { pilot: "Track pilot steers", wire: "Autopilot on the wire steers", page: "Mariner steers", fmu: "FMU steers", ardupilot: "ArduPilot steers" };
const TO = { pilot: "Hand to track pilot", wire: "Hand to wire", page: "Take over", fmu: "Hand to FMU", ardupilot: "Hand to ArduPilot" };
const STATES = { V: "to acknowledge", A: "acknowledged", U: "over, to acknowledge" };

const PRIORITIES = ["A", "W", "C"], ORDER = ["V", "U", "A"];  // alarm, warning, caution; unacknowledged ones first
const URGENT = { A: "Alarm", W: "Warning", C: "Caution" };

/** Alarms as rows of the wire, the most urgent first: unacknowledged, over but unacknowledged, acknowledged; each by priority, then latest. */
export const urgent = alarms => [...alarms].sort((a, b) => ORDER.indexOf(a[3]) - ORDER.indexOf(b[3])
  || PRIORITIES.indexOf(a[2]) - PRIORITIES.indexOf(b[2]) || b[5] - a[5]);

/** What the header says of them: how many, the worst as text, and its priority and state; empty where there is none. */
export function badge(alarms) {
  const [worst] = urgent(alarms);
  return worst ? { count: alarms.length, text: `${URGENT[worst[2]]}: ${worst[4]}`, priority: worst[2], state: worst[3] }
    : { count: 0, text: "No alarm", priority: "", state: "" };
}

/** Other ships as rows of the wire, the dangerous first, then by the distance of the nearest approach that is still ahead. */
export const nearest = rows => [...rows].sort((a, b) => Number(b[7]) - Number(a[7]) || Number(a[6] < 0) - Number(b[6] < 0) || a[5] - b[5]);

export class Range {
  constructor(link) {
    this.link = link;
    this.#seen = {};
    $("over").onclick = () => this.take();
    $("badge").onclick = () => $("alarms").scrollIntoView({ block: "center" });
  }

  #seen;

  begin(hello) {
    this.hello = hello.range;
    this.#seen = {};
    $("range").hidden = $("watch").hidden = hello.range === null;
    if (hello.range === null) return;
    $("scenario").textContent = hello.range.title;
    $("hand").replaceChildren(...hello.range.known.map(to => {
      const button = make("button", { type: "button", "data-to": to, title: to === "page" ? "Take over (T)" : null }, TO[to]);
      button.onclick = () => this.link.ask({ do: "hand", to });
      return button;
    }));
    $("faults").replaceChildren(...hello.range.faults.map((label, number) => {
      const button = make("button", { type: "button", "data-fault": number }, label);
      button.onclick = () => this.link.ask({ do: "fault", number, on: button.getAttribute("aria-pressed") !== "true" });
      return button;
    }));
    $("instructor").hidden = hello.range.faults.length === 0;
  }

  /** Whether manual orders are obeyed. */
  get manual() { return !this.link.last?.range || this.link.last.range.steers === "page"; }

  /** Take over from whoever steers; whether there is a range. */
  take() {
    if (!this.hello) return false;
    this.link.ask({ do: "hand", to: "page" });
    return true;
  }

  /** Acknowledge the latest alarm that is to be. */
  acknowledge() {
    const next = urgent(this.link.last?.range?.alarms ?? []).find(([, , , state]) => state !== "A");
    if (next) this.link.ask({ do: "acknowledge", identifier: next[0], instance: next[1] });
    return Boolean(next);
  }

  show(frame) {
    const range = frame.range;
    if (!range) return;
    const mine = this.link.commands, wire = range.wire;
    const who = range.steers === "wire" ? `${CALLED.wire}${wire[0] ? `: ${wire[0]}, ${wire[1]}${wire[2] ? ", silent" : ""}` : ", nobody yet"}` : CALLED[range.steers];
    this.#put("steers", who, () => {
      for (const place of [$("steers"), $("who")]) { place.textContent = who; place.dataset.by = range.steers; }
    });
    $("over").hidden = range.steers === "page";
    $("over").disabled = !mine;
    this.#put("badge", JSON.stringify(range.alarms), () => this.#badge(badge(range.alarms)));
    for (const button of document.querySelectorAll("#hand button")) {
      button.disabled = !mine || button.dataset.to === range.steers;
    }
    for (const button of document.querySelectorAll("[data-fault]")) {
      button.disabled = !mine;
      button.setAttribute("aria-pressed", String(range.faults[Number(button.dataset.fault)]));
    }
    this.#put("alarms", JSON.stringify([range.alarms, mine]), () => this.#alarms(range.alarms, mine));
    this.#contacts(range.contacts);
  }

  #badge({ count, text, priority, state }) {
    $("count").textContent = String(count); $("worst").textContent = text;
    $("badge").dataset.worst = priority; $("badge").dataset.state = state;
  }

  #alarms(alarms, mine) {
    $("alarms").replaceChildren(...urgent(alarms).map(([identifier, instance, priority, state, text, changed]) => {
      const button = make("button", { type: "button", disabled: !mine || state === "A" }, state === "A" ? "Acknowledged" : "Acknowledge");
      button.onclick = () => this.link.ask({ do: "acknowledge", identifier, instance });
      return make("li", { "data-priority": priority, "data-state": state }, make("b", {}, text), ` ${clock(changed)}, ${STATES[state]} `, button);
    }));
  }

  #contacts(every) {
    const rows = nearest(every);
    const body = $("contacts").tBodies[0];
    $("contacts").hidden = rows.length === 0;
    const cells = rows.map(([name, distance, bearing, U, chi, cpa, tcpa]) => [name, fixed(distance / MILE, 2), course(bearing).slice(0, 3),
      fixed(U / KNOT, 1), course(chi).slice(0, 3), fixed(cpa / MILE, 2), fixed(tcpa / 60, 1)]);
    this.#put("contacts", JSON.stringify([cells, rows.map(row => row[7])]), () => body.replaceChildren(...cells.map((row, k) =>
      make("tr", { class: rows[k][7] ? "dangerous" : null }, ...row.map((cell, n) => make("td", {}, n === 0 && rows[k][7] ? `! ${cell}` : cell))))));
  }

  #put(what, text, draw) {
    if (this.#seen[what] === text) return;
    this.#seen[what] = text;
    draw();
  }
}
