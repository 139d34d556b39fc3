// The conning display: heading, course, speeds and rate of turn in large figures.

import { nice } from "./shared/canvas.js";
import { make } from "./shared/dom.js";
import { DEGREE, KNOT, course, fixed, sided } from "./shared/units.js";

const CELLS = [
  ["heading", "Heading", "°"], ["course", "Course", "°"], ["turn", "Rate of turn", "°/min"],
  ["speed", "Speed, ground", "kn"], ["water", "Ahead, water", "kn"], ["drift", "Drift angle", ""],
  ["across", "Sideways", "kn"], ["gap", "Ghost, distance", "m"], ["off", "Ghost, heading", ""],
];

const STILL = 0.02;  // share of the approach speed below which no course is shown

export class Conning {
  constructor(section) {
    section.replaceChildren(
      ...CELLS.map(([id, name, unit]) => make("div", { class: "cell", "data-cell": id }, make("span", {}, name), make("b", {}, "–"), make("i", {}, unit))),
      make("div", { class: "rate" }, make("span", {}, "Rate of turn, scale to ", make("output")),
        make("div", { class: "rot" }, make("i", { class: "zero" }), make("i", { class: "actual" }), make("span", {}, "P"), make("span", {}, "S"))),
    );
    this.end = section.querySelector(".rate output");
    this.cells = Object.fromEntries([...section.querySelectorAll("[data-cell]")].map(cell => [cell.dataset.cell, cell]));
    this.bar = section.querySelector(".rot .actual");
  }

  begin(hello) {
    this.still = STILL * hello.speed;
    const most = nice(hello.speed / hello.ship.L * 60 / DEGREE);  // beyond the rate of a hard turn of most ships
    this.most = most * DEGREE / 60;
    this.end.textContent = `${most} °/min`;
    for (const id of ["gap", "off"]) this.cells[id].hidden = hello.ghost === null;
  }

  draw({ own, around, ghost }) {
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
    this.#put("gap", ghost ? fixed(ghost[3]) : "–");
    this.#put("off", ghost ? sided(ghost[4] / DEGREE, 1, "°") : "–");
    const share = Math.min(Math.abs(r) / this.most, 1) * 50;
    this.bar.style.left = `${r < 0 ? 50 - share : 50}%`;
    this.bar.style.width = `${share}%`;
  }

  #put(id, text) {
    const cell = this.cells[id].children[1];
    if (cell.textContent !== text) cell.textContent = text;
  }
}
