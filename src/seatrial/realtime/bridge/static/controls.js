// Rudder, telegraph, thrusters and azimuths: one scale or dial for each order, by mouse, touch and keyboard.

import { nice } from "./shared/canvas.js";
import { drawn, make } from "./shared/dom.js";
import { DEGREE, fixed, shown, sided } from "./shared/units.js";

const HOLD = 600;  // ms for which a value set on the page has precedence over the last picture

/** Common part of all controls: the ordered value, and orders sent at most twenty times a second. */
class Control {
  constructor(order, send) {
    this.order = order; this.value = 0; this.touched = -Infinity; this.apart = false;
    const [unit, factor] = shown(order.unit), span = (order.high - order.low) * order.per * factor;
    this.unit = unit; this.factor = factor * order.per;
    this.digits = span <= 10 ? 2 : span <= 400 ? 1 : 0;
    this.angle = order.unit === "rad";
    this.fine = this.angle ? DEGREE : nice(span / 100) / this.factor;
    this.act = make("span", { class: "act" });
    this.clip = make("span", { class: "clip", hidden: true }, "LIMIT");
    this.input = make("input", { type: "number", step: "any", "aria-label": `${order.label} ordered [${unit}]${order.sided ? ", starboard positive" : ""}` });
    const asked = make("label", { title: order.sided && "Positive to starboard, negative to port" }, make("span", { class: "word" }, "ordered"), " ", this.input, ` ${unit}`);
    this.element = make("div", { class: "control" }, make("div", { class: "says" }, make("b", {}, order.label), this.act, this.clip, asked));
    this.input.onchange = () => { if (this.input.value !== "") this.#ask(Number(this.input.value) / this.factor); this.input.blur(); };
    this.#send = send;
  }

  #send; #timer = null; #waits = null; #seen = "";

  /** Order a value within the scale. */
  set(value) { this.#ask(Math.min(Math.max(value, this.order.low), this.order.high)); }

  /** A number of smallest steps as text. */
  step(n) { return `${Number((n * this.fine * this.factor).toPrecision(3))}${this.angle ? "" : " "}${this.unit}`; }

  nudge(by) { this.set(Math.round((this.value + by) / this.fine) * this.fine); }

  #ask(value) {
    if (this.input.disabled) return;  // no command, or no contact
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

  /** Show ordered and actual values of the ship; null where unknown, or where the parts of a shared order differ. */
  show(ordered, actual, clipped, enabled) {
    const touched = performance.now() - this.touched <= HOLD;
    if (ordered !== null && !touched) this.value = ordered;
    this.apart = ordered === null && !touched;
    const seen = `${this.apart} ${this.value.toFixed(4)} ${actual?.toFixed(4)} ${clipped} ${enabled}`;
    if (seen === this.#seen && document.activeElement !== this.input) return;  // nothing has changed
    this.#seen = seen;
    this.actual = actual;
    this.element.classList.toggle("locked", !enabled);
    this.element.classList.toggle("apart", this.apart);
    this.input.disabled = !enabled;
    for (const button of this.element.querySelectorAll("button")) button.disabled = !enabled;
    this.clip.hidden = !clipped;
    this.act.textContent = this.figure(actual);
    if (document.activeElement !== this.input) {
      const text = (this.value * this.factor).toFixed(this.digits);
      this.input.value = this.apart ? "" : Number(text) === 0 ? Math.abs(text).toFixed(this.digits) : text;
    }
    this.draw();
  }

  /** A value as text, with its side where it has one. */
  figure(value) {
    if (value === null || value === undefined) return this.order.parts > 1 ? "apart" : "–";
    const size = value * this.factor, unit = this.angle ? this.unit : ` ${this.unit}`;
    return this.order.sided ? sided(size, this.digits, unit) : `${fixed(size, this.digits)}${unit}`;
  }

  /** Make an element a slider for pointer, keyboard and screen readers. */
  slider(element, valueAt, step) {
    element.tabIndex = 0;
    element.setAttribute("role", "slider");
    element.setAttribute("aria-label", this.order.label);
    element.setAttribute("aria-valuemin", (this.order.low * this.factor).toFixed(this.digits));
    element.setAttribute("aria-valuemax", (this.order.high * this.factor).toFixed(this.digits));
    let held = false;
    element.addEventListener("pointerdown", e => { held = true; element.setPointerCapture(e.pointerId); this.set(valueAt(e)); e.preventDefault(); });  // no focus: the keys keep steering the rudder
    element.addEventListener("pointermove", e => { if (held) this.set(valueAt(e)); });
    for (const end of ["pointerup", "pointercancel"]) element.addEventListener(end, () => { held = false; });
    element.addEventListener("keydown", e => {
      const way = { ArrowRight: 1, ArrowUp: 1, ArrowLeft: -1, ArrowDown: -1 }[e.key];
      if (!way || e.target.closest("#rudders, #engines")) return;  // these have keys of their own
      this.nudge(way * (e.shiftKey ? this.fine : step)); e.preventDefault(); e.stopPropagation();
    });
    this.aria = element;
  }

  say() {
    this.aria?.setAttribute("aria-valuenow", (this.value * this.factor).toFixed(this.digits));
    this.aria?.setAttribute("aria-valuetext", this.figure(this.apart ? null : this.value));
  }
}

/** A straight scale; horizontal for rudders, vertical for engines. */
export class Scale extends Control {
  constructor(order, send, upright, bells) {
    super(order, send);
    this.upright = upright;
    this.element.classList.add(upright ? "upright" : "across");
    const bar = make("div", { class: "bar" }, make("i", { class: "zero" }), make("i", { class: "actual" }), make("i", { class: "ordered" }));
    const row = make("div", { class: "row" }, bar);
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

  /** Move to the next position of the telegraph. */
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
    for (const [value, button] of this.bells) button.setAttribute("aria-pressed", String(!this.apart && Math.abs(value - this.value) < 0.02 * this.order.full));
    this.say();
  }

  /** A button for each position of the telegraph within the range of the engine. */
  #telegraph(bells) {
    const { low, high, full } = this.order, list = make("div", { class: "bells" });
    this.bar.querySelector(".zero").style.bottom = `${100 * -low / (high - low)}%`;
    for (const [share, text] of bells) {
      const value = share * full, button = make("button", { type: "button" }, text);
      if (value < low - 1e-9 || value > high + 1e-9) continue;
      button.onclick = () => this.set(value);
      this.bells.push([value, button]);
      list.append(button);
    }
    return list;
  }

  #marks() {
    const { low, high } = this.order, share = v => 100 * (v - low) / (high - low), size = this.order.sided ? Math.abs : v => v;
    this.bar.querySelector(".zero").style.left = `${share(0)}%`;
    const end = value => [value, fixed(Number((size(value) * this.factor).toPrecision(Math.abs(value * this.factor) < 1000 ? 3 : 4)), 3).replace(/\.?0+$/, "")];
    const marks = this.angle ? [-30, -20, -10, 0, 10, 20, 30].map(d => [d * DEGREE, `${Math.abs(d)}`]) : [...(low ? [end(low)] : []), [0, "0"], end(high)];
    if (this.order.sided) this.bar.append(make("span", { class: "way port" }, "P"), make("span", { class: "way starboard" }, "S"));
    this.bar.classList.toggle("sided", this.order.sided);
    this.bar.style.setProperty("--zero", `${share(0)}%`);
    for (const [value, text] of marks) {
      if (value < low - 1e-9 || value > high + 1e-9) continue;
      const minor = this.angle && value && Math.abs(value) < 29 * DEGREE;
      const mark = make("button", { type: "button", tabindex: -1, class: minor ? "mark minor" : "mark" }, text);
      mark.style.left = `${share(value)}%`;
      mark.addEventListener("pointerdown", e => e.stopPropagation());
      mark.onclick = () => this.set(value);
      this.bar.append(mark);
    }
  }
}

/** A round dial for azimuths; up is ahead, clockwise to starboard. */
export class Dial extends Control {
  constructor(order, send) {
    super(order, send);
    this.element.classList.add("dial");
    const ticks = Array.from({ length: 12 }, (_, k) => drawn("path", { class: "tick", transform: `rotate(${30 * k})`, d: "M0 -46V-41" }));
    this.needle = drawn("path", { class: "actual", d: "M-5 14L0 -36L5 14Z" });
    this.mark = drawn("path", { class: "ordered", d: "M0 -30V-46M-5 -38L0 -46L5 -38" });
    const svg = drawn("svg", { viewBox: "-50 -50 100 100" }, drawn("circle", { r: 46 }),
      drawn("path", { class: "port", d: "M0 -48A48 48 0 0 0 0 48" }), drawn("path", { class: "starboard", d: "M0 -48A48 48 0 0 1 0 48" }), ...ticks, this.needle, this.mark);
    this.element.append(svg);
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
    this.act.textContent = this.actual === null ? "–" : sided((this.actual - turned) / DEGREE, 1, "°");
    this.needle.setAttribute("transform", `rotate(${(this.actual ?? 0) / DEGREE})`);
    this.mark.setAttribute("transform", `rotate(${this.value / DEGREE})`);
    this.say();
  }
}

/** All controls of a ship. */
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

  /** Effect of the keys for this ship: for each a list of words and keys. */
  hints() {
    const rudder = this.rudder, engine = this.engine, by = n => rudder.step(n), key = text => make("kbd", {}, text);
    const rest = [...this.controls.values()].filter(control => control !== rudder && control !== engine);
    return [
      ...(rudder ? [[key("←"), " ", key("→"), ` ${rudder.order.label.toLowerCase()} ${by(5)}, with `, key("Shift"), ` ${by(1)}`],
        [key("Space"), rudder.angle ? " midships" : " none"]] : []),
      ...(engine ? [[key("↑"), " ", key("↓"), ` ${engine.order.unit === "1/s" ? "telegraph" : engine.order.label.toLowerCase()}`]] : []),
      ...(rest.length ? [[key("Tab"), ` to ${rest[0].order.label.toLowerCase()}${rest.length > 1 ? " and others" : ""}: the arrow keys then move it`]] : []),
    ];
  }

  /** Handle a key; returns whether it is one of the page. */
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
