// The autopilot panel: manual, heading, track; the heading to steer by number, by steps and by keys.

import { make } from "./shared/dom.js";
import { DEGREE, course, fixed, sided } from "./shared/units.js";

const MODES = [["manual", "Manual"], ["heading", "Heading"], ["track", "Track"]];
const STEPS = [-10, -1, 1, 10];

export class Pilot {
  constructor(section, link, range) {
    this.link = link; this.range = range;
    this.input = make("input", { type: "number", min: 0, max: 360, step: "any", "aria-label": "Heading to steer [°]" });
    this.modes = new Map(MODES.map(([mode, text]) => [mode, make("button", { type: "button", "data-mode": mode }, text)]));
    this.steps = STEPS.map(by => {
      const button = make("button", { type: "button", "aria-label": `Heading ${Math.abs(by)} degrees to ${by < 0 ? "port" : "starboard"}` }, `${by < 0 ? "−" : "+"}${Math.abs(by)}`);
      button.onclick = () => this.nudge(by);
      return button;
    });
    this.state = make("span", { class: "state", role: "status" });
    section.replaceChildren(make("b", {}, "Autopilot"), make("div", { class: "modes", role: "group" }, ...this.modes.values()),
      make("label", {}, make("span", {}, "set "), this.input, " °"), make("div", { class: "steps" }, ...this.steps), this.state);
    this.modes.get("manual").onclick = () => this.manual();
    this.modes.get("heading").onclick = () => this.hold();
    this.modes.get("track").onclick = () => this.track();
    this.input.onchange = () => { if (this.input.value !== "") this.#hold(Number(this.input.value) * DEGREE); this.input.blur(); };
  }

  begin(hello) { this.able = hello.autopilot; this.tracks = hello.range?.known.includes("pilot") ?? false; }

  /** Who or what steers: manual, heading, track, or wire. */
  get mode() {
    const { range, held } = this.link.last ?? {};
    if (range && range.steers !== "page") return range.steers === "pilot" ? "track" : "wire";
    return typeof held === "number" ? "heading" : "manual";
  }

  manual() { if (!this.range.manual) this.range.take(); else this.link.ask({ do: "manual" }); }

  /** Hold the present heading. */
  hold() { this.#hold(this.link.last.own[2]); }

  /** Follow the route, where there is one. */
  track() { if (this.tracks) this.link.ask({ do: "hand", to: "pilot" }); }

  /** Change the heading that is held by degrees; does nothing while none is. */
  nudge(by) { if (this.mode === "heading") this.#hold((Math.round(this.link.last.held / DEGREE) + by) * DEGREE); }

  #hold(psi) {
    if (!this.range.manual) this.range.take();
    this.link.ask({ do: "hold", psi });
  }

  show(frame) {
    const mode = this.mode, mine = this.link.commands;
    for (const [name, button] of this.modes) {
      button.setAttribute("aria-pressed", String(name === mode));
      button.disabled = !mine || (name === "heading" && !this.able) || (name === "track" && !this.tracks);
    }
    this.modes.get("track").title = this.tracks ? "Follow the route (G)" : "No route: start the bridge with --scenario";
    for (const element of [this.input, ...this.steps]) element.disabled = !mine || !this.able || (element !== this.input && mode !== "heading");
    if (document.activeElement !== this.input) this.input.value = mode === "heading" ? fixed(Number(course(frame.held))) : "";
    const text = this.#says(mode, frame);
    if (this.state.textContent !== text) this.state.textContent = text;
  }

  #says(mode, frame) {
    if (mode === "heading") {
      const off = frame.own[2] - frame.held;
      return `${sided(Math.atan2(Math.sin(off), Math.cos(off)) / DEGREE, 1, "°")} off`;
    }
    const leg = frame.range?.leg;
    return mode === "track" && leg ? `leg ${leg[0] + 1}, ${sided(leg[1], 0, " m")} of it` : "";
  }
}
