// Rudder, telegraph, thrusters and azimuths: one scale or dial for each order, by mouse, touch and keyboard.

import { DEGREE, fixed, label, shown, sided } from "./units.js";

const BELLS = [[1, "Full ahead"], [0.65, "Half"], [0.45, "Slow"], [0.3, "Dead slow"], [0, "Stop"],
  [-0.3, "Dead slow"], [-0.45, "Slow"], [-0.65, "Half"], [-1, "Full astern"]];
const HOLD = 600;  // ms for which a hand on the page counts more than what the last picture says

/** What all controls share: the value at hand, and orders that go out no more than twenty times a second. */
class Control {
  constructor(order, send) {
    this.order = order; this.value = 0; this.touched = -Infinity;
    [this.unit, this.factor] = shown(order.unit);
    this.angle = order.unit === "rad";
    this.fine = this.angle ? DEGREE : (order.high - order.low) / 100;
    this.element = document.createElement("div");
    this.element.className = "control";
    this.element.innerHTML = `<div class="says"><b>${label(order.name)}</b><span class="act"></span>`
      + `<label>ordered <input type="number" step="any" aria-label="${label(order.name)} ordered [${this.unit}]"> ${this.unit}</label>`
      + `<span class="clip" hidden>LIMIT</span></div>`;
    this.input = this.element.querySelector("input");
    this.input.onchange = () => { if (this.input.value !== "") this.#ask(Number(this.input.value) / this.factor); this.input.blur(); };
    this.#send = send;
  }

  #send; #timer = null; #waits = null; #seen = "";

  /** Order a value within the scale. */
  set(value) { this.#ask(Math.min(Math.max(value, this.order.low), this.order.high)); }

  nudge(by) { this.set(Math.round((this.value + by) / this.fine) * this.fine); }

  #ask(value) {
    this.value = value; this.touched = performance.now(); this.draw();
    this.#waits = value;
    if (this.#timer === null) this.#flush();
  }

  #flush() {
    if (this.#waits === null) { this.#timer = null; return; }
    this.#send({ do: "order", name: this.order.name, value: this.#waits });
    this.#waits = null;
    this.#timer = setTimeout(() => this.#flush(), 50);
  }

  /** What the ship says: ordered and actual. */
  show(ordered, actual, clipped, enabled) {
    if (performance.now() - this.touched > HOLD) this.value = ordered;
    const seen = `${this.value.toFixed(4)} ${actual.toFixed(4)} ${clipped} ${enabled}`;
    if (seen === this.#seen && document.activeElement !== this.input) return;  // what stays needs no drawing
    this.#seen = seen;
    this.actual = actual;
    this.element.classList.toggle("locked", !enabled);
    this.input.disabled = !enabled;
    for (const button of this.element.querySelectorAll("button")) button.disabled = !enabled;
    this.element.querySelector(".clip").hidden = !clipped;
    const says = this.angle ? sided(actual * this.factor, 1, "°") : `${fixed(actual * this.factor)} ${this.unit}`;
    this.element.querySelector(".act").textContent = says;
    if (document.activeElement !== this.input) {
      const text = (this.value * this.factor).toFixed(1);
      this.input.value = text === "-0.0" ? "0.0" : text;
    }
    this.draw();
  }

  /** Make an element a slider for hands, keys and screen readers. */
  slider(element, valueAt, step) {
    element.tabIndex = 0;
    element.setAttribute("role", "slider");
    element.setAttribute("aria-label", label(this.order.name));
    element.setAttribute("aria-valuemin", (this.order.low * this.factor).toFixed(1));
    element.setAttribute("aria-valuemax", (this.order.high * this.factor).toFixed(1));
    let held = false;
    element.addEventListener("pointerdown", e => { held = true; element.setPointerCapture(e.pointerId); element.focus(); this.set(valueAt(e)); e.preventDefault(); });
    element.addEventListener("pointermove", e => { if (held) this.set(valueAt(e)); });
    for (const end of ["pointerup", "pointercancel"]) element.addEventListener(end, () => { held = false; });
    element.addEventListener("keydown", e => {
      const way = { ArrowRight: 1, ArrowUp: 1, ArrowLeft: -1, ArrowDown: -1 }[e.key];
      if (!way || e.target.closest("#rudders, #engines")) return;  // the page's own keys steer those
      this.nudge(way * (e.shiftKey ? this.fine : step)); e.preventDefault(); e.stopPropagation();
    });
    this.aria = element;
  }

  say() { this.aria?.setAttribute("aria-valuenow", (this.value * this.factor).toFixed(1)); }
}

/** A straight scale; across for rudders, upright for engines. */
export class Scale extends Control {
  constructor(order, send, upright) {
    super(order, send);
    this.upright = upright;
    this.element.classList.add(upright ? "upright" : "across");
    const bar = document.createElement("div");
    bar.className = "bar";
    bar.innerHTML = '<i class="zero"></i><i class="actual"></i><i class="ordered"></i>';
    const row = document.createElement("div");
    row.className = "row";
    row.append(bar);
    this.element.append(row);
    this.bar = bar;
    this.bells = [];
    if (upright) row.append(this.#telegraph());
    else this.#marks();
    const snap = this.angle ? DEGREE : this.fine;
    this.slider(bar, e => {
      const box = bar.getBoundingClientRect();
      const share = upright ? 1 - (e.clientY - box.top) / box.height : (e.clientX - box.left) / box.width;
      return Math.round((order.low + share * (order.high - order.low)) / snap) * snap;
    }, this.angle ? 5 * DEGREE : 5 * this.fine);
  }

  /** To the next position of the telegraph. */
  bell(way) {
    const near = this.fine / 4, sorted = this.bells.map(([value]) => value).sort((a, b) => a - b);
    const next = way > 0 ? sorted.find(v => v > this.value + near) : sorted.findLast(v => v < this.value - near);
    if (next !== undefined) this.set(next);
  }

  draw() {
    const share = v => 100 * Math.min(Math.max((v - this.order.low) / (this.order.high - this.order.low), 0), 1);
    const zero = share(0), now = share(this.actual ?? 0), [from, to] = now < zero ? [now, zero] : [zero, now];
    const [, actual, ordered] = this.bar.querySelectorAll("i");
    if (this.upright) {
      actual.style.bottom = `${from}%`; actual.style.height = `${to - from}%`;
      ordered.style.bottom = `${share(this.value)}%`;
    } else {
      actual.style.left = `${from}%`; actual.style.width = `${to - from}%`;
      ordered.style.left = `${share(this.value)}%`;
    }
    for (const [value, button] of this.bells) button.setAttribute("aria-pressed", String(Math.abs(value - this.value) < this.fine / 2));
    this.say();
  }

  /** A button for each position of the telegraph that the engine has. */
  #telegraph() {
    const { low, high, full } = this.order, list = document.createElement("div");
    list.className = "bells";
    this.bar.querySelector(".zero").style.bottom = `${100 * -low / (high - low)}%`;
    for (const [share, text] of BELLS) {
      const value = share * full, button = document.createElement("button");
      if (value < low - 1e-9 || value > high + 1e-9) continue;
      button.textContent = text; button.type = "button";
      button.onclick = () => this.set(value);
      this.bells.push([value, button]);
      list.append(button);
    }
    return list;
  }

  #marks() {
    const { low, high } = this.order, share = v => 100 * (v - low) / (high - low);
    this.bar.querySelector(".zero").style.left = `${share(0)}%`;
    const marks = this.angle ? [-30, -20, -10, 0, 10, 20, 30].map(d => [d * DEGREE, `${Math.abs(d)}`])
        : [[low, fixed(low * this.factor, 0)], [0, "0"], [high, fixed(high * this.factor, 0)]];
    for (const [value, text] of marks) {
      if (value < low - 1e-9 || value > high + 1e-9) continue;
      const mark = document.createElement("button");
      mark.className = "mark"; mark.type = "button"; mark.tabIndex = -1; mark.textContent = text;
      mark.style.left = `${share(value)}%`;
      mark.addEventListener("pointerdown", e => e.stopPropagation());
      mark.onclick = () => this.set(value);
      this.bar.append(mark);
    }
  }
}

/** A round dial for what turns all the way; up is ahead, clockwise to starboard. */
export class Dial extends Control {
  constructor(order, send) {
    super(order, send);
    this.element.classList.add("dial");
    const ticks = Array.from({ length: 12 }, (_, k) => `<path class="tick" transform="rotate(${30 * k})" d="M0 -46V-41"/>`).join("");
    this.element.insertAdjacentHTML("beforeend", `<svg viewBox="-50 -50 100 100"><circle r="46"/>${ticks}`
      + '<path class="actual" d="M-5 14L0 -36L5 14Z"/><path class="ordered" d="M0 -30V-46M-5 -38L0 -46L5 -38"/></svg>');
    const svg = this.element.querySelector("svg");
    this.slider(svg, e => {
      const box = svg.getBoundingClientRect();
      const angle = Math.atan2(e.clientX - box.left - box.width / 2, box.top + box.height / 2 - e.clientY);
      const near = angle + 2 * Math.PI * Math.round((this.value - angle) / (2 * Math.PI));
      const whole = near >= order.low && near <= order.high ? near : angle;
      return Math.round(whole / DEGREE) * DEGREE;
    }, 5 * DEGREE);
  }

  draw() {
    this.element.querySelector("svg .actual").setAttribute("transform", `rotate(${(this.actual ?? 0) / DEGREE})`);
    this.element.querySelector("svg .ordered").setAttribute("transform", `rotate(${this.value / DEGREE})`);
    this.say();
  }
}

/** All controls of a ship in their places. */
export class Helm {
  constructor(hello, send, places) {
    for (const place of Object.values(places)) place.replaceChildren();
    const orders = hello.orders, has = name => orders.some(o => o.name === name);
    this.controls = new Map();
    for (const order of orders) {
      const kind = order.name.split("_")[0], engine = order.name === "n_P" || order.name.startsWith("n_P_");
      const control = kind === "alpha" ? new Dial(order, send) : new Scale(order, send, engine);
      this.controls.set(order.name, control);
      const single = (kind === "delta" && order.name !== "delta" && has("delta")) || (order.name.startsWith("n_P_") && has("n_P"));
      const place = kind === "delta" && !single ? places.rudders : engine && !single ? places.engines : places.thrusters;
      if (single) control.element.classList.add("single");
      place.append(control.element);
    }
    places.thrusters.hidden = !places.thrusters.children.length;
    const first = kind => [...this.controls.keys()].find(name => name.startsWith(kind));
    this.rudder = this.controls.get("delta") ?? this.controls.get(first("delta"));
    this.engine = this.controls.get("n_P") ?? this.controls.get(first("n_P"));
  }

  show(state, clipped, enabled) {
    for (const [name, control] of this.controls) control.show(state.ord[name], state.act[name], clipped.includes(name), enabled);
  }

  /** The page's own keys; whether this was one. */
  key(e) {
    const step = e.shiftKey ? DEGREE : 5 * DEGREE;
    const does = {
      ArrowLeft: () => this.rudder?.nudge(-step), ArrowRight: () => this.rudder?.nudge(step), " ": () => this.rudder?.set(0),
      ArrowUp: () => this.engine?.bell(1), ArrowDown: () => this.engine?.bell(-1),
    }[e.key];
    does?.();
    return does !== undefined;
  }
}
