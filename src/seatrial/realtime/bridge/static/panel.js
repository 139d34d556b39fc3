// Everything except the controls: command, time, manoeuvres and their indices, recording, ghost, weather, log.

import { DEGREE, KNOT, clock, figure, fixed, sided } from "./shared/units.js";

const $ = id => document.getElementById(id);
const STEERS = "#pause, #step, #reset, #save, #back, #pace, #record, #drills button, #drills input";
const put = (element, text) => { if (element.textContent !== text) element.textContent = text; };

export class Panel {
  constructor(link, say) {
    this.link = link;
    this.say = say;
    const ask = request => () => link.ask(request);
    $("take").onclick = ask({ do: "take" }); $("give").onclick = ask({ do: "give" }); $("keep").onclick = ask({ do: "keep" });
    $("pause").onclick = () => this.pause(); $("step").onclick = ask({ do: "step" }); $("reset").onclick = ask({ do: "reset" });
    $("save").onclick = ask({ do: "save" }); $("back").onclick = ask({ do: "back" });
    $("pace").onchange = ({ target }) => { link.ask({ do: "pace", factor: Number(target.value) || target.value }); target.blur(); };
    $("record").onclick = () => link.ask({ do: link.last?.record && !link.last.record[2] ? "unrecord" : "record" });
    $("lay").onclick = ask({ do: "ghost" }); $("follow").onclick = ask({ do: "ghost", follow: true });
    $("around").querySelector("form").onsubmit = e => {
      e.preventDefault();
      const of = name => Number(e.target.elements[name].value);
      link.ask({ do: "around", U_T: of("U_T") * KNOT, gamma_T: of("gamma_T") * DEGREE, U_C: of("U_C") * KNOT, gamma_C: of("gamma_C") * DEGREE });
    };
  }

  begin(hello) {
    document.title = `${hello.ship.name} – bridge`;
    put($("ship"), hello.ship.name);
    $("buttons").replaceChildren(...hello.drills.map(name => {
      const button = document.createElement("button");
      button.textContent = name; button.dataset.drill = name;
      button.title = hello.cannot[name] ?? "";
      button.onclick = () => this.link.ask(button.getAttribute("aria-pressed") === "true" ? { do: "end" } : { do: "drill", name });
      return button;
    }));
    this.cannot = hello.cannot;
    const reasons = [...new Set(Object.values(hello.cannot))], names = why => Object.keys(hello.cannot).filter(name => hello.cannot[name] === why);
    put($("cannot"), reasons.map(why => `${names(why).join(", ")}: ${why}.`).join(" "));
    $("ghost").hidden = hello.ghost === null;
    this.feels = { U_T: hello.feels.wind, gamma_T: hello.feels.wind, U_C: hello.feels.current, gamma_C: hello.feels.current };
    const none = Object.keys(hello.feels).filter(what => !hello.feels[what]);
    put($("unfelt"), none.length ? `${hello.ship.name} has no force of ${none.join(" and of ")}.` : "");
    this.#filled = false;
  }

  #filled = false; #told = -1; #figures = ""; #failure = ""; #lost = false;

  pause() { this.link.ask({ do: this.link.last?.paused ? "resume" : "pause" }); }

  /** Contact was lost: the age of the data and the reason, while this page cannot steer; or null. */
  contact(lost) {
    if (lost === null) {
      if (this.#lost && this.link.last) this.show(this.link.last);
      this.#lost = false;
      return;
    }
    this.#lost = true;
    put($("holder"), `No contact for ${lost.age.toFixed(0)} s: ${lost.why}`);
    $("command").dataset.state = "lost";
    $("command").title = "This page cannot give orders now";
    $("take").hidden = $("asked").hidden = true;
    for (const element of document.querySelectorAll(STEERS)) element.disabled = true;
  }

  show(frame) {
    const [holder, asking, stale, present] = frame.command, me = this.link.hello.hello, mine = holder === me;
    put($("clock"), clock(frame.t));
    put($("holder"), stale ? `${holder} is silent` : mine ? "You have command" : `${holder} has command`);
    $("command").title = `You are ${me}; connected: ${present.join(", ")}`;
    $("command").dataset.state = stale ? "stale" : mine ? "mine" : "theirs";
    $("take").hidden = mine;
    put($("take"), stale ? "Take command" : asking === me ? "Asked…" : "Ask for command");
    $("asked").hidden = !(mine && asking && present.includes(asking));
    put($("asked").firstElementChild, `${asking} asks for command.`);
    put($("pause"), frame.paused ? "Resume" : "Pause");
    $("step").hidden = !frame.paused;
    this.#pace(frame.factor);
    put($("back"), frame.kept === null ? "Back" : `Back to ${clock(frame.kept)}`);
    $("back").hidden = frame.kept === null;
    this.#recording(frame.record);
    for (const element of document.querySelectorAll(STEERS)) element.disabled = !mine;
    for (const input of document.querySelectorAll("#around input")) input.disabled = !mine || !this.feels[input.name];
    for (const button of document.querySelectorAll("[data-drill]")) button.disabled = !mine || button.dataset.drill in this.cannot;
    this.#drill(frame.drill);
    this.#ghost(frame);
    this.#log(frame);
    if (!this.#filled) this.#fill(frame.around);
  }

  /** Show the time factor, also one that is not in the list. */
  #pace(factor) {
    const pace = $("pace"), value = factor === null ? "fastest" : String(factor);
    if (document.activeElement === pace || pace.value === value) return;
    if (![...pace.options].some(option => option.value === value)) {
      const after = [...pace.options].find(option => !(Number(option.value) < factor)) ?? null;
      pace.add(new Option(`${Number(factor.toPrecision(3))}×`, value), after);
    }
    pace.value = value;
  }

  /** Show the recording: none, in progress, or ended by itself, which stays until another one begins. */
  #recording(record) {
    const button = $("record"), [path, rows, failure] = record ?? ["", 0, ""], goes = record !== null && !failure;
    button.setAttribute("aria-pressed", String(goes));
    button.dataset.state = failure ? "failed" : goes ? "goes" : "none";
    put(button, failure ? `Recording failed after ${rows} rows` : goes ? `Recording, ${rows} rows` : "Record");
    button.title = failure ? `${failure}. Press to start another one` : path || "Record to a trial file";
    if (failure && failure !== this.#failure) this.say(`Recording ended: ${failure}`, true);
    this.#failure = failure;
  }

  #drill(drill) {
    for (const button of document.querySelectorAll("[data-drill]"))
      button.setAttribute("aria-pressed", String(drill !== null && !drill[1] && drill[0] === button.dataset.drill));
    const text = JSON.stringify(drill);
    if (text === this.#figures) return;
    this.#figures = text;
    if (drill === null) { $("figures").replaceChildren(); return; }
    const [name, over, complete, indices] = drill, table = document.createElement("table");
    const state = complete ? "complete" : over ? "ended" : "in progress; any manual order ends it";
    table.createCaption().textContent = `${name}: ${state}`;
    for (const index of indices) {
      const row = table.insertRow();
      for (const cell of figure(index)) row.insertCell().textContent = cell;
    }
    $("figures").replaceChildren(table);
  }

  #ghost(frame) {
    const ghost = this.link.hello.ghost;
    if (ghost === null) return;
    const off = frame.ghost ? `${fixed(frame.ghost[3])} m away, heading difference ${sided(frame.ghost[4] / DEGREE, 1, "°")}` : "not running";
    put($("ghost-says"), `${ghost.name}${ghost.ship && ghost.ship !== this.link.hello.ship.name ? `, a trial of ${ghost.ship}` : ""} (${clock(ghost.duration)}): ${off}${frame.following ? "; its orders are applied" : ""}`);
  }

  #log(frame) {
    if (frame.told === this.#told) return;
    const fresh = this.#told >= 0 && frame.told > this.#told ? frame.events.at(-1) : null;
    this.#told = frame.told;
    $("events").replaceChildren(...frame.events.toReversed().map(([t, kind, text]) => {
      const line = document.createElement("li");
      line.textContent = `${clock(t)} ${kind}: ${text}`;
      line.dataset.kind = kind;
      return line;
    }));
    if (fresh && fresh[1] !== "heard" && fresh[1] !== "inside") this.say(`${fresh[1]}: ${fresh[2]}`);
  }

  #fill([wx, wy, cx, cy]) {
    this.#filled = true;
    const form = $("around").querySelector("form"), degrees = (y, x) => ((Math.atan2(y, x) / DEGREE + 360) % 360).toFixed(0);
    const set = (name, value) => { form.elements[name].value = value; };
    set("U_T", (Math.hypot(wx, wy) / KNOT).toFixed(1)); set("gamma_T", degrees(wy, wx));
    set("U_C", (Math.hypot(cx, cy) / KNOT).toFixed(1)); set("gamma_C", degrees(cy, cx));
  }
}
