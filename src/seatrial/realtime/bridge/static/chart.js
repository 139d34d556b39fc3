// The chart: north up, in metres, with the ship to scale, its track, other ships, wind and current.

import { fitted, nice } from "./shared/canvas.js";
import { drawn, make } from "./shared/dom.js";
import { KNOT, course, fixed } from "./shared/units.js";

const SHAPE = [[0.5, 0], [0.42, 0.3], [0.3, 0.5], [-0.44, 0.5], [-0.5, 0.38]];
const HULL = [...SHAPE, ...SHAPE.slice(1).reverse().map(([x, y]) => [x, -y])];
const MOST = 8000;

export class Chart {
  constructor(section, colours) {
    this.canvas = section.querySelector("canvas");
    this.weather = section.querySelector("#weather");
    this.colours = colours;
    this.track = []; this.ghostTrack = []; this.tracks = {};
    this.follow = true; this.centre = [0, 0]; this.metre = null;
    this.#pointers = new Map();
    this.#listen(section);
  }

  #pointers;

  begin(hello) {
    if (this.hello?.ship.L !== hello.ship.L) this.metre = null;
    this.hello = hello;
    this.track = hello.trail.map(row => [row[1], row[2]]);
    this.ghostTrack = []; this.tracks = {};
  }

  clear() { this.track = []; this.ghostTrack = []; this.tracks = {}; }

  /** Add the positions of all ships to their tracks, with a minimum distance between points. */
  keep(frame) {
    const apart = this.hello.ship.L / 30;
    const add = (track, pose) => {
      const end = track.at(-1);
      if (!end || Math.hypot(end[0] - pose[0], end[1] - pose[1]) > apart) track.push([pose[0], pose[1]]);
      if (track.length > MOST) track.splice(0, MOST / 4);
    };
    add(this.track, frame.own);
    if (frame.ghost) add(this.ghostTrack, frame.ghost);
    for (const [name, pose] of Object.entries(frame.others)) add(this.tracks[name] ??= [], pose);
  }

  zoom(by, at = null) {
    const { width, height } = this.size, [px, py] = at ?? [width / 2, height / 2];
    const low = 2 / this.hello.ship.L, next = Math.min(Math.max(this.metre * by, low / 40), low * 300);
    if (!this.follow) {
      const dx = (px - width / 2) * (1 / this.metre - 1 / next), dy = (py - height / 2) * (1 / this.metre - 1 / next);
      this.centre = [this.centre[0] - dy, this.centre[1] + dx];
    }
    this.metre = next;
  }

  draw(state) {
    const { g, width, height } = fitted(this.canvas), c = this.colours();
    this.metre ??= Math.min(width, height) / (9 * this.hello.ship.L);
    if (this.follow) this.centre = [state.own[0], state.own[1]];
    g.fillStyle = c.water;
    g.fillRect(0, 0, width, height);
    this.#grid(g, c);
    this.#line(g, this.track, state.own, c.actual, 2, []);
    for (const [name, pose] of Object.entries(state.others)) {
      this.#line(g, this.tracks[name] ?? [], pose, c.other, 1.5, [2, 4]);
      this.#hull(g, this.hello.others[name], pose, c.other, name.replace(/^\d+ /, ""));
      this.#vector(g, this.hello.others[name], pose, c.other);
    }
    if (state.ghost) {
      this.#line(g, this.ghostTrack, state.ghost, c.ghost, 2, [8, 5]);
      this.#hull(g, this.hello.ship, state.ghost, c.ghost, "ghost", true);
    } else if (this.ghostTrack.length) this.#line(g, this.ghostTrack, this.ghostTrack.at(-1), c.ghost, 2, [8, 5]);
    this.#ahead(g, state.own, c);
    this.#hull(g, this.hello.ship, state.own, c.actual, "");
    this.#vector(g, this.hello.ship, state.own, c.actual);
    this.#scale(g, c);
    this.#arrows(state, c);
  }

  get size() { return { width: this.canvas.clientWidth, height: this.canvas.clientHeight }; }

  #at(x, y) {
    const { width, height } = this.size;
    return [width / 2 + (y - this.centre[1]) * this.metre, height / 2 - (x - this.centre[0]) * this.metre];
  }

  #grid(g, c) {
    const step = nice(90 / this.metre), { width, height } = this.size;
    const [north, east] = [this.centre[0] + height / 2 / this.metre, this.centre[1] - width / 2 / this.metre];
    g.strokeStyle = c.line; g.lineWidth = 1; g.setLineDash([]);
    g.beginPath();
    for (let y = Math.ceil(east / step) * step; ; y += step) {
      const px = Math.round(this.#at(0, y)[0]) + 0.5;
      if (px > width) break;
      g.moveTo(px, 0); g.lineTo(px, height);
    }
    for (let x = Math.floor(north / step) * step; ; x -= step) {
      const py = Math.round(this.#at(x, 0)[1]) + 0.5;
      if (py > height) break;
      g.moveTo(0, py); g.lineTo(width, py);
    }
    g.stroke();
  }

  #line(g, points, end, colour, width, dash) {
    if (!points.length) return;
    g.strokeStyle = colour; g.lineWidth = width; g.setLineDash(dash); g.lineJoin = "round";
    g.beginPath();
    g.moveTo(...this.#at(...points[0]));
    for (const point of points) g.lineTo(...this.#at(...point));
    g.lineTo(...this.#at(end[0], end[1]));
    g.globalAlpha = 0.75; g.stroke(); g.globalAlpha = 1; g.setLineDash([]);
  }

  /** A hull to scale, with a circle where it would be too small to see. */
  #hull(g, ship, pose, colour, name, hollow = false) {
    const [px, py] = this.#at(pose[0], pose[1]), L = ship.L * this.metre, B = ship.B * this.metre;
    g.save();
    g.translate(px, py); g.rotate(pose[2]);
    g.beginPath();
    for (const [x, y] of HULL) g.lineTo(y * B, -x * L);
    g.closePath();
    g.lineWidth = 1.6; g.strokeStyle = colour; g.fillStyle = colour;
    if (!hollow) { g.globalAlpha = 0.35; g.fill(); g.globalAlpha = 1; } else g.setLineDash([5, 3]);
    g.stroke();
    g.setLineDash([]);
    if (L < 12) { g.beginPath(); g.arc(0, 0, 7, 0, 2 * Math.PI); g.stroke(); }
    g.restore();
    if (name) { g.fillStyle = colour; g.font = "12px system-ui, sans-serif"; g.fillText(name, px + Math.max(B, 8), py - 8); }
  }

  /** Heading as a thin line; velocity over ground as an arrow: the distance run in the time of two ship lengths. */
  #vector(g, ship, pose, colour) {
    const [x, y, psi, u, v] = pose, span = 2 * ship.L / Math.max(this.hello.speed, 1e-3);
    const vx = u * Math.cos(psi) - v * Math.sin(psi), vy = u * Math.sin(psi) + v * Math.cos(psi);
    g.strokeStyle = colour; g.fillStyle = colour; g.lineWidth = 1;
    g.beginPath();
    g.moveTo(...this.#at(x, y)); g.lineTo(...this.#at(x + 1.6 * ship.L * Math.cos(psi), y + 1.6 * ship.L * Math.sin(psi)));
    g.stroke();
    g.lineWidth = 2;
    arrow(g, ...this.#at(x, y), ...this.#at(x + vx * span, y + vy * span));
  }

  /** Predicted track at constant speed and rate of turn. */
  #ahead(g, [x, y, psi, u, v, r], c) {
    const span = 4 * this.hello.ship.L / Math.max(this.hello.speed, 1e-3), steps = 24, dt = span / steps;
    g.strokeStyle = c.muted; g.lineWidth = 1.5; g.setLineDash([2, 5]);
    g.beginPath();
    g.moveTo(...this.#at(x, y));
    for (let k = 0; k < steps; k += 1) {
      const heading = psi + r * dt * (k + 0.5);
      x += (u * Math.cos(heading) - v * Math.sin(heading)) * dt;
      y += (u * Math.sin(heading) + v * Math.cos(heading)) * dt;
      g.lineTo(...this.#at(x, y));
    }
    g.stroke(); g.setLineDash([]);
  }

  #scale(g, c) {
    const step = nice(90 / this.metre), px = step * this.metre, { height } = this.size, y = height - 14;
    g.strokeStyle = g.fillStyle = c.ink; g.lineWidth = 2;
    g.beginPath(); g.moveTo(12, y - 5); g.lineTo(12, y); g.lineTo(12 + px, y); g.lineTo(12 + px, y - 5); g.stroke();
    g.font = "12px system-ui, sans-serif";
    g.fillText(step >= 1000 ? `${step / 1000} km` : `${step} m`, 16, y - 6);
  }

  #arrows(state, c) {
    const [wx, wy, cx, cy] = state.around;  // wind: direction from; current: direction towards
    const wind = Math.hypot(wx, wy), current = Math.hypot(cx, cy);
    const shown = [one("Wind", "from", wind, Math.atan2(wy, wx), Math.PI), one("Current", "to", current, Math.atan2(cy, cx), 0)];
    const told = JSON.stringify([shown, c.ordered, c.other]);
    if (this.weather.dataset.told === told) return;
    this.weather.dataset.told = told;
    this.weather.replaceChildren(...shown.map(([degrees, text], k) => degrees === null ? make("span", { class: "calm" }, text)
      : make("span", {}, drawn("svg", { viewBox: "-12 -12 24 24", "aria-hidden": "true" }, drawn("g", { transform: `rotate(${degrees})` },
        drawn("path", { d: "M0 10V-9M-5 -3L0 -10L5 -3", stroke: [c.ordered, c.other][k] }))), text)));
  }

  #listen(section) {
    const canvas = this.canvas, pointers = this.#pointers;
    canvas.addEventListener("wheel", e => { e.preventDefault(); this.zoom(Math.exp(-e.deltaY / 500), [e.offsetX, e.offsetY]); }, { passive: false });
    canvas.addEventListener("pointerdown", e => { canvas.setPointerCapture(e.pointerId); pointers.set(e.pointerId, [e.offsetX, e.offsetY]); });
    canvas.addEventListener("pointermove", e => {
      const before = pointers.get(e.pointerId);
      if (!before) return;
      const now = [e.offsetX, e.offsetY];
      if (pointers.size === 2) {
        const [other] = [...pointers].filter(([id]) => id !== e.pointerId).map(([, at]) => at);
        const far = p => Math.max(Math.hypot(p[0] - other[0], p[1] - other[1]), 1);
        this.zoom(far(now) / far(before));
      } else if (Math.hypot(now[0] - before[0], now[1] - before[1]) > 2 || !this.follow) {
        this.follow = false;
        this.centre = [this.centre[0] + (now[1] - before[1]) / this.metre, this.centre[1] - (now[0] - before[0]) / this.metre];
      } else return;
      pointers.set(e.pointerId, now);
    });
    for (const end of ["pointerup", "pointercancel"]) canvas.addEventListener(end, e => pointers.delete(e.pointerId));
    section.querySelector('[data-zoom="in"]').onclick = () => this.zoom(1.5);
    section.querySelector('[data-zoom="out"]').onclick = () => this.zoom(1 / 1.5);
    section.querySelector('[data-zoom="centre"]').onclick = () => { this.follow = true; };
  }
}

/** Direction of the arrow of a wind or a current [deg], null where there is none, and its text. */
function one(what, word, size, direction, turn) {
  if (size < 1e-6) return [null, `${what}: none`];
  return [Math.round((direction + turn) / Math.PI * 180), `${what} ${fixed(size / KNOT)} kn ${word} ${course(direction).slice(0, 3)}°`];
}

function arrow(g, x0, y0, x1, y1) {
  const length = Math.hypot(x1 - x0, y1 - y0);
  if (length < 4) return;
  const angle = Math.atan2(y1 - y0, x1 - x0);
  g.beginPath(); g.moveTo(x0, y0); g.lineTo(x1, y1); g.stroke();
  g.beginPath(); g.moveTo(x1, y1);
  for (const side of [-1, 1]) g.lineTo(x1 - 9 * Math.cos(angle + side * 0.4), y1 - 9 * Math.sin(angle + side * 0.4));
  g.fill();
}
