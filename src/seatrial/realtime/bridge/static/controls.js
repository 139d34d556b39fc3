// Rudder, telegraph, thrusters and azimuths: one scale or dial for each order, by mouse, touch and keyboard.

import { nice } from "./shared/canvas.js";
import { DEGREE, fixed, shown, sided } from "./shared/units.js";

const HOLD = 600;  // ms for which a hand on the page counts more than what the last picture says

/** What all controls share: the value at hand, and orders that go out no more than twenty times a second. */
class Control {
  constructor(order, send) {
    this.order = order; this.value = 0; this.touched = -Infinity;
    const [unit, factor] = shown(order.unit), span = (order.high - order.low) * order.per * factor;
    this.unit = unit; this.factor = factor * order.per;
    this.digits = span <= 10 ? 2 : span <= 400 ? 1 : 0;
    this.angle = order.unit === "rad";
    this.fine = this.angle ? DEGREE : nice(span / 100) / this.factor;
    this.element = document.createElement("div");
    this.element.className = "control";
    this.element.innerHTML = `<div class="says"><b>${order.label}</b><span class="act"></span><span class="clip" hidden>LIMIT</span>`
      + `<label><span class="word">ordered</span> <input type="number" step="any" aria-label="${order.label} ordered [${unit}]${order.sided ? ", starboard positive" : ""}"> ${unit}</label></div>`;
    if (order.sided) this.element.querySelector("label").title = "Starboard is above zero, port below";
    this.input = this.element.querySelector("input");
    this.input.onchange = () => { if (this.input.value !== "") this.#ask(Number(this.input.value) / this.factor); this.input.blur(); };
    this.#send = send;
  }

  #send; #timer = null; #waits = null; #seen = "";

  /** Order a value within the scale. */
  set(value) { this.#ask(Math.min(Math.max(value, this.order.low), this.order.high)); }

  /** So many of the least steps, in figures. */
  step(n) { return `${Number((n * this.fine * this.factor).toPrecision(3))}${this.angle ? "" : " "}${this.unit}`; }

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
    if (ordered === null || actual === null) return;  // nobody knows
    if (performance.now() - this.touched > HOLD) this.value = ordered;
    const seen = `${this.value.toFixed(4)} ${actual.toFixed(4)} ${clipped} ${enabled}`;
    if (seen === this.#seen && document.activeElement !== this.input) return;  // what stays needs no drawing
    this.#seen = seen;
    this.actual = actual;
    this.element.classList.toggle("locked", !enabled);
    this.input.disabled = !enabled;
    for (const button of this.element.querySelectorAll("button")) button.disabled = !enabled;
    this.element.querySelector(".clip").hidden = !clipped;
    this.element.querySelector(".act").textContent = this.#text(actual);
    if (document.activeElement !== this.input) {
      const text = (this.value * this.factor).toFixed(this.digits);
      this.input.value = Number(text) === 0 ? Math.abs(text).toFixed(this.digits) : text;
    }
    this.draw();
  }

  /** A value in figures; where it has a side, with that. */
  #text(value) {
    const size = value * this.factor, unit = this.angle ? this.unit : ` ${this.unit}`;
    return this.order.sided ? sided(size, this.digits, unit) : `${fixed(size, this.digits)}${unit}`;
  }

  /** Make an element a slider for hands, keys and screen readers. */
  slider(element, valueAt, step) {
    element.tabIndex = 0;
    element.setAttribute("role", "slider");
    element.setAttribute("aria-label", this.order.label);
    element.setAttribute("aria-valuemin", (this.order.low * this.factor).toFixed(this.digits));
    element.setAttribute("aria-valuemax", (this.order.high * this.factor).toFixed(this.digits));
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

  say() {
    this.aria?.setAttribute("aria-valuenow", (this.value * this.factor).toFixed(this.digits));
    this.aria?.setAttribute("aria-valuetext", this.#text(this.value));
  }
}

/** A straight scale; across for rudders, upright for engines. */
export class Scale extends Control {
  constructor(order, send, upright, bells) {
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
    if (upright) row.append(this.#telegraph(bells));
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
    const near = 0.02 * this.order.full, sorted = this.bells.map(([value]) => value).sort((a, b) => a - b);
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
    for (const [value, button] of this.bells) button.setAttribute("aria-pressed", String(Math.abs(value - this.value) < 0.02 * this.order.full));
    this.say();
  }

  /** A button for each position of the telegraph that the engine has. */
  #telegraph(bells) {
    const { low, high, full } = this.order, list = document.createElement("div");
    list.className = "bells";
    this.bar.querySelector(".zero").style.bottom = `${100 * -low / (high - low)}%`;
    for (const [share, text] of bells) {
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
    const end = value => [value, fixed(Number((value * this.factor).toPrecision(Math.abs(value * this.factor) < 1000 ? 3 : 4)), 3).replace(/\.?0+$/, "")];
    const marks = this.angle ? [-30, -20, -10, 0, 10, 20, 30].map(d => [d * DEGREE, `${Math.abs(d)}`]) : [...(low ? [end(low)] : []), [0, "0"], end(high)];
    if (this.order.sided) this.bar.insertAdjacentHTML("beforeend", '<span class="way">P</span><span class="way">S</span>');
    for (const [value, text] of marks) {
      if (value < low - 1e-9 || value > high + 1e-9) continue;
      const mark = document.createElement("button");
      mark.className = this.angle && value && Math.abs(value) < 29 * DEGREE ? "mark minor" : "mark"; mark.type = "button"; mark.tabIndex = -1; mark.textContent = text;
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
    const turned = Math.round((this.actual ?? 0) / (2 * Math.PI)) * 2 * Math.PI;
    this.element.querySelector(".act").textContent = sided(((this.actual ?? 0) - turned) / DEGREE, 1, "°");
    this.element.querySelector("svg .actual").setAttribute("transform", `rotate(${(this.actual ?? 0) / DEGREE})`);
    this.element.querySelector("svg .ordered").setAttribute("transform", `rotate(${this.value / DEGREE})`);
    this.say();
  }
}

/** All controls of a ship in their places. */
export class Helm {
  constructor(hello, send, places) {
    for (const place of Object.values(places)) place.replaceChildren();
    this.controls = new Map();
    for (const order of hello.orders) {
      const control = order.kind === "dial" ? new Dial(order, send) : new Scale(order, send, order.kind === "engine", hello.bells);
      this.controls.set(order.name, control);
      (places[`${order.kind}s`] ?? places.thrusters).append(control.element);
    }
    places.thrusters.hidden = !places.thrusters.children.length;
    const first = kind => [...this.controls.values()].find(control => control.order.kind === kind);
    this.rudder = first("rudder");
    this.engine = first("engine");
    places.engines.hidden = !this.engine;
  }

  show(state, clipped, enabled) {
    for (const [name, control] of this.controls) control.show(state.ord[name], state.act[name], clipped.includes(name), enabled);
  }

  /** What the page's own keys do to this ship. */
  hints() {
    const rudder = this.rudder, engine = this.engine, by = n => rudder.step(n);
    return [
      ...(rudder ? [`<kbd>←</kbd> <kbd>→</kbd> ${rudder.order.label.toLowerCase()} ${by(5)}, with <kbd>Shift</kbd> ${by(1)}`,
        `<kbd>Space</kbd> ${rudder.angle ? "midships" : "none"}`] : []),
      ...(engine ? [`<kbd>↑</kbd> <kbd>↓</kbd> ${engine.order.unit === "1/s" ? "telegraph" : engine.order.label.toLowerCase()}`] : []),
    ];
  }

  /** The page's own keys; whether this was one. */
  key(e) {
    const step = (this.rudder?.fine ?? 0) * (e.shiftKey ? 1 : 5);
    const does = {
      ArrowLeft: () => this.rudder?.nudge(-step), ArrowRight: () => this.rudder?.nudge(step), " ": () => this.rudder?.set(0),
      ArrowUp: () => this.engine?.bell(1), ArrowDown: () => this.engine?.bell(-1),
    }[e.key];
    does?.();
    return does !== undefined;
  }
}
