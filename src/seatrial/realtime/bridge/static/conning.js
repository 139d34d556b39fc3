// The conning display: a tape of the heading; heading, course, speeds, wind and depth in large figures; place and UTC.

import { fitted, font, nice, scale } from "./shared/canvas.js";
import { make } from "./shared/dom.js";
import { DEGREE, KNOT, angle, course, fixed, sided, utc } from "./shared/units.js";

const CELLS = [
  ["heading", "Heading", "°"], ["course", "Course", "°"], ["turn", "Rate of turn", "°/min"],
  ["speed", "Speed, ground", "kn"], ["water", "Ahead, water", "kn"], ["drift", "Drift angle", ""],
  ["across", "Sideways", "kn"], ["wind", "Wind, relative", "kn"], ["from", "Wind from bow", ""],
  ["depth", "Depth", "m"], ["keel", "Under keel", "m"], ["gap", "Ghost, distance", "m"], ["off", "Ghost, heading", ""],
];

const STILL = 0.02;  // share of the approach speed below which no course is shown

const TAPE = 40;  // degrees of heading to each side

export class Conning {
  constructor(section, colours) {
    this.colours = colours;
    this.tape = make("canvas", { "aria-label": "Heading, red to port and green to starboard" });
    this.place = make("output", { id: "place" });
    section.replaceChildren(make("div", { class: "tape" }, this.tape),
      ...CELLS.map(([id, name, unit]) => make("div", { class: "cell", "data-cell": id }, make("span", {}, name), make("b", {}, "–"), make("i", {}, unit))),
      make("div", { class: "rate" }, make("span", {}, "Rate of turn, scale to ", make("output")),
        make("div", { class: "rot" }, make("i", { class: "zero" }), make("i", { class: "actual" }), make("span", {}, "P"), make("span", {}, "S"))), this.place,
    );
    this.end = section.querySelector(".rate output");
    this.cells = Object.fromEntries([...section.querySelectorAll("[data-cell]")].map(cell => [cell.dataset.cell, cell]));
    this.bar = section.querySelector(".rot .actual");
  }

  begin(hello) {
    this.still = STILL * hello.speed;
    this.draught = hello.draught; this.epoch = hello.epoch;
    const most = nice(hello.speed / hello.ship.L * 60 / DEGREE);  // beyond the rate of a hard turn of most ships
    this.most = most * DEGREE / 60;
    this.end.textContent = `${most} °/min`;
    for (const id of ["gap", "off"]) this.cells[id].hidden = hello.ghost === null;
  }

  draw({ own, around, ghost, t }, { place, depth }) {
    const [, , psi, u, v, r] = own, [, , cx, cy] = around;
    const uw = u - cx * Math.cos(psi) - cy * Math.sin(psi), vw = v + cx * Math.sin(psi) - cy * Math.cos(psi);
    const U = Math.hypot(u, v), moving = U > this.still;
    this.#put("heading", course(psi));
    this.#put("course", moving ? course(psi + Math.atan2(v, u)) : "–");
    this.#put("turn", sided(r * 60 / DEGREE));
    this.#put("speed", fixed(U / KNOT, 2));
    this.#put("water", fixed(uw / KNOT, 2));
    this.#put("drift", moving ? sided(Math.atan2(vw, uw) / DEGREE, 1, "°") : "–");
    this.#put("across", sided(v / KNOT, 2));
    this.#wind(own, around);
    this.#put("depth", depth === null ? "–" : fixed(depth));
    this.#put("keel", depth === null || !this.draught ? "–" : fixed(depth - this.draught));
    this.#heading(psi);
    const where = place ? `${angle(place[0], "N", "S", 2)} ${angle(place[1], "E", "W", 3)}  ` : "";
    const text = `${where}${this.epoch === null ? "" : `${utc(this.epoch + t)} UTC`}`;
    if (this.place.textContent !== text) this.place.textContent = text;
    this.#put("gap", ghost ? fixed(ghost[3]) : "–");
    this.#put("off", ghost ? sided(ghost[4] / DEGREE, 1, "°") : "–");
    const share = Math.min(Math.abs(r) / this.most, 1) * 50;
    this.bar.style.left = `${r < 0 ? 50 - share : 50}%`;
    this.bar.style.width = `${share}%`;
  }

  /** Wind as it is felt aboard: its speed, and where it comes from, relative to the bow. */
  #wind([, , psi, u, v], [wx, wy]) {
    const c = Math.cos(psi), s = Math.sin(psi), ahead = u + wx * c + wy * s, aside = v - wx * s + wy * c, U = Math.hypot(ahead, aside);
    this.#put("wind", fixed(U / KNOT));
    this.#put("from", U > this.still ? sided(Math.atan2(aside, ahead) / DEGREE, 0, "°") : "–");
  }

  /** The tape moves under a fixed mark; its port half is red, its starboard half green. */
  #heading(psi) {
    const now = psi / DEGREE, c = this.colours(), seen = `${now.toFixed(2)} ${c.ink} ${innerWidth} ${innerHeight}`;
    if (seen === this.seen || !this.tape.clientWidth) return;
    this.seen = seen;
    const { g, width, height } = fitted(this.tape), k = scale(), middle = width / 2, per = middle / TAPE;
    g.clearRect(0, 0, width, height);
    g.fillStyle = c.port; g.fillRect(0, 0, middle, 4 * k);
    g.fillStyle = c.starboard; g.fillRect(middle, 0, middle, 4 * k);
    g.strokeStyle = g.fillStyle = c.ink; g.lineWidth = 1; g.textAlign = "center"; g.font = font(12);
    for (let degrees = Math.ceil((now - TAPE) / 5) * 5; degrees <= now + TAPE; degrees += 5) {
      const x = middle + (degrees - now) * per;
      g.beginPath(); g.moveTo(x, 4 * k); g.lineTo(x, (degrees % 10 ? 8 : 12) * k); g.stroke();
      if (degrees % 10 === 0 && Math.abs(x - middle) < middle - 12 * k) g.fillText(course(degrees * DEGREE).slice(0, 3), x, 25 * k);
    }
    g.fillStyle = c.actual;
    g.beginPath(); g.moveTo(middle, 13 * k); g.lineTo(middle - 6 * k, 0); g.lineTo(middle + 6 * k, 0); g.fill();
  }

  #put(id, text) {
    const cell = this.cells[id].children[1];
    if (cell.textContent !== text) cell.textContent = text;
  }
}
