// The chart: the ship to scale with its track, other ships, wind and current, over what `land` and `rings` draw.

import { Land } from "./land.js";
import { Rings } from "./rings.js";
import { Vectors, reach } from "./vectors.js";
import { View } from "./view.js";
import { fitted, font, nice, scale } from "./shared/canvas.js";
import { drawn, make } from "./shared/dom.js";
import { KNOT, MILE, course, fixed, miles } from "./shared/units.js";

const SHAPE = [[0.5, 0], [0.42, 0.3], [0.3, 0.5], [-0.44, 0.5], [-0.5, 0.38]];
const HULL = [...SHAPE, ...SHAPE.slice(1).reverse().map(([x, y]) => [x, -y])];
const MOST = 8000;

export class Chart {
  constructor(section, colours) {
    this.canvas = section.querySelector("canvas");
    this.weather = section.querySelector("#weather"); this.reads = section.querySelector("#reads");
    this.colours = colours;
    this.track = []; this.ghostTrack = []; this.tracks = {};
    this.vectors = new Vectors(section.querySelector("#vectors"));
    this.view = new View(); this.rings = new Rings(); this.land = new Land(); this.own = null;
    this.#pointers = new Map();
    this.#listen(section);
  }

  #pointers;

  begin(hello) {
    if (this.hello?.ship.L !== hello.ship.L) this.view.metre = null;
    this.hello = hello;
    this.land.begin(hello);
    this.vectors.begin(hello.ship, hello.speed);
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

  zoom(by, at = null) { this.view.zoom(by, this.hello.ship.L, at); }

  /** Turn bearing line and range marker on or off. */
  marker() { if (this.own) this.rings.toggle(this.own, this.view); }

  draw(state, range, ahead) {
    const { g, width, height } = fitted(this.canvas), c = this.colours(), view = this.view;
    view.metre ??= Math.min(width, height) / (9 * this.hello.ship.L);
    view.fit(width, height, state.own);
    this.own = state.own;
    g.fillStyle = c.water;
    g.fillRect(0, 0, width, height);
    this.land.draw(g, view, range?.leg?.[0], c);
    this.rings.draw(g, view, state.own, c);
    this.#line(g, this.track, state.own, c.actual, 2, []);
    this.#others(g, state, new Set((range?.contacts ?? []).filter(row => row[7]).map(row => row[0])), c);
    if (state.ghost) {
      this.#line(g, this.ghostTrack, state.ghost, c.ghost, 2, [8, 5]);
      this.#hull(g, this.hello.ship, state.ghost, c.ghost, true);
    } else if (this.ghostTrack.length) this.#line(g, this.ghostTrack, this.ghostTrack.at(-1), c.ghost, 2, [8, 5]);
    if (ahead?.rows.length && state.t - ahead.t < 0.5 * this.hello.bands.span) this.#likely(g, ahead, state.own, c);
    else this.#ahead(g, state.own, c);
    this.#hull(g, this.hello.ship, state.own, c.actual);
    this.#vector(g, this.hello.ship, state.own, c.actual);
    this.#scale(g, ahead, c);
    this.#arrows(state, c);
  }

  #at(x, y) { return this.view.at(x, y); }

  /** Other ships; names that would cover each other are left out, those of dangerous ships come first. */
  #others(g, state, dangerous, c) {
    const names = Object.keys(state.others).sort((a, b) => dangerous.has(b) - dangerous.has(a)), taken = [], k = scale();
    for (const name of names) {
      const pose = state.others[name], colour = dangerous.has(name) ? c.ordered : c.other;
      this.#line(g, this.tracks[name] ?? [], pose, c.other, 1.5, [2, 4]);
      this.#hull(g, this.hello.others[name], pose, colour);
      this.#vector(g, this.hello.others[name], pose, colour);
      const [x, y] = this.#at(pose[0], pose[1]), text = `${dangerous.has(name) ? "! " : ""}${name.replace(/^\d+ /, "")}`;
      g.font = font(12, dangerous.has(name) ? "600" : "");
      const box = [x + 9 * k, y - 20 * k, x + 9 * k + g.measureText(text).width, y - 6 * k];
      if (taken.some(one => box[0] < one[2] && one[0] < box[2] && box[1] < one[3] && one[1] < box[3])) continue;
      taken.push(box);
      g.fillStyle = colour; g.fillText(text, box[0], y - 8 * k);
    }
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
  #hull(g, ship, pose, colour, hollow = false) {
    const [px, py] = this.#at(pose[0], pose[1]), L = ship.L * this.view.metre, B = ship.B * this.view.metre;
    g.save();
    g.translate(px, py); g.rotate(pose[2] - this.view.turned);
    g.beginPath();
    for (const [x, y] of HULL) g.lineTo(y * B, -x * L);
    g.closePath();
    g.lineWidth = 1.6; g.strokeStyle = colour; g.fillStyle = colour;
    if (!hollow) { g.globalAlpha = 0.35; g.fill(); g.globalAlpha = 1; } else g.setLineDash([5, 3]);
    g.stroke();
    g.setLineDash([]);
    if (L < 12) {  // too small to see: a triangle that points where it heads
      const k = 9 * scale();
      g.beginPath(); g.moveTo(0, -k); g.lineTo(0.55 * k, 0.8 * k); g.lineTo(-0.55 * k, 0.8 * k); g.closePath(); g.stroke();
    }
    g.restore();
  }

  /** Heading as a thin line; velocity over ground as an arrow to where the ship is after the time of all vectors. */
  #vector(g, ship, pose, colour) {
    const [x, y, psi] = pose;
    g.strokeStyle = colour; g.fillStyle = colour; g.lineWidth = 1;
    g.beginPath();
    g.moveTo(...this.#at(x, y)); g.lineTo(...this.#at(x + 1.6 * ship.L * Math.cos(psi), y + 1.6 * ship.L * Math.sin(psi)));
    g.stroke();
    g.lineWidth = 2;
    arrow(g, ...this.#at(x, y), ...this.#at(...reach(pose, this.vectors.time)));
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

  /** Predicted track under the orders that hold, and where bands say the ship may be: a fan, and ellipses on the way. */
  #likely(g, { rows, why }, own, c) {
    if (!why) {
      const out = way => rows.map(([, x, y, , xx, xy, yy], k) => {
        const [, x0, y0] = rows[Math.max(k - 1, 0)], [, x1, y1] = rows[Math.min(k + 1, rows.length - 1)];
        const far = Math.hypot(x1 - x0, y1 - y0) || 1, nx = (y0 - y1) / far, ny = (x1 - x0) / far;
        const off = way * Math.sqrt(Math.max(xx * nx * nx + 2 * xy * nx * ny + yy * ny * ny, 0));
        return this.#at(x + off * nx, y + off * ny);
      });
      g.fillStyle = g.strokeStyle = c.actual; g.lineWidth = 1;
      g.beginPath();
      for (const point of [...out(1), ...out(-1).reverse()]) g.lineTo(...point);
      g.closePath();
      g.globalAlpha = 0.22; g.fill(); g.globalAlpha = 0.85;
      for (let k = rows.length - 1; k > 0; k -= Math.ceil(rows.length / 4)) this.#ellipse(g, rows[k]);
      g.globalAlpha = 1;
    }
    g.strokeStyle = c.actual; g.lineWidth = 1.5; g.setLineDash([2, 5]);
    g.beginPath();
    g.moveTo(...this.#at(own[0], own[1]));
    for (const [, x, y] of rows.slice(1)) g.lineTo(...this.#at(x, y));
    g.stroke(); g.setLineDash([]);
  }

  /** The ellipse d' M^-1 d = 1 about a place: the root of M by Cholesky times a circle. */
  #ellipse(g, [, x, y, , xx, xy, yy]) {
    const a = Math.sqrt(xx), b = a > 0 ? xy / a : 0, d = Math.sqrt(Math.max(yy - b * b, 0));
    g.beginPath();
    for (let k = 0; k < 48; k += 1) {
      const s = Math.sin(k / 24 * Math.PI), q = Math.cos(k / 24 * Math.PI);
      g.lineTo(...this.#at(x + a * q, y + b * q + d * s));
    }
    g.closePath(); g.stroke();
  }

  #scale(g, ahead, c) {
    const step = nice(90 / this.view.metre / MILE) * MILE, px = step * this.view.metre, k = scale(), y = this.view.height - 14 * k;
    g.strokeStyle = g.fillStyle = c.ink; g.lineWidth = 2 * k;
    g.beginPath(); g.moveTo(12 * k, y - 5 * k); g.lineTo(12 * k, y); g.lineTo(12 * k + px, y); g.lineTo(12 * k + px, y - 5 * k); g.stroke();
    g.font = font(12);
    g.fillText(miles(step), 16 * k, y - 6 * k);
    const text = [this.view.says, this.rings.shown ? `rings ${miles(Rings.apart(this.view))}` : "", this.rings.marker ? this.rings.says(this.own) : "", this.#bands(ahead)].filter(Boolean).join(" · ");
    if (this.reads.textContent !== text) this.reads.textContent = text;
  }

  /** What the fan is, or why there is none. */
  #bands(ahead) {
    const bands = this.hello.bands;
    if (!bands || !ahead) return "";
    if (ahead.why) return `no bands: ${ahead.why}`;
    const far = bands.span < 120 ? `${fixed(bands.span, 0)} s` : `${fixed(bands.span / 60)} min`;
    return `path ${far}, ${fixed(bands.level, 0)} % of positions${bands.calibrated ? "" : " (parameters only)"}`;
  }

  #arrows(state, c) {
    const [wx, wy, cx, cy] = state.around;  // wind: direction from; current: direction towards
    const wind = Math.hypot(wx, wy), current = Math.hypot(cx, cy);
    const shown = [one("Wind", "from", wind, Math.atan2(wy, wx), Math.PI), one("Current", "to", current, Math.atan2(cy, cx), 0)];
    const up = Math.round(this.view.turned / Math.PI * 180), told = JSON.stringify([shown, up, c.ordered, c.other]);
    if (this.weather.dataset.told === told) return;
    this.weather.dataset.told = told;
    this.weather.replaceChildren(...shown.map(([degrees, text], k) => degrees === null ? make("span", { class: "calm" }, text)
      : make("span", {}, drawn("svg", { viewBox: "-12 -12 24 24", "aria-hidden": "true" }, drawn("g", { transform: `rotate(${degrees - up})` },
        drawn("path", { d: "M0 10V-9M-5 -3L0 -10L5 -3", stroke: [c.ordered, c.other][k] }))), text)));
  }

  #listen(section) {
    const canvas = this.canvas, pointers = this.#pointers;
    canvas.addEventListener("wheel", e => { e.preventDefault(); this.zoom(Math.exp(-e.deltaY / 500), [e.offsetX, e.offsetY]); }, { passive: false });
    let moved = 0;
    canvas.addEventListener("pointerdown", e => { moved = pointers.size; canvas.setPointerCapture(e.pointerId); pointers.set(e.pointerId, [e.offsetX, e.offsetY]); });
    canvas.addEventListener("pointermove", e => {
      const before = pointers.get(e.pointerId);
      if (!before) return;
      const now = [e.offsetX, e.offsetY], by = Math.hypot(now[0] - before[0], now[1] - before[1]);
      if (pointers.size === 2) {
        const [other] = [...pointers].filter(([id]) => id !== e.pointerId).map(([, at]) => at);
        const far = p => Math.max(Math.hypot(p[0] - other[0], p[1] - other[1]), 1);
        this.zoom(far(now) / far(before));
      } else if (by > 2 || moved) this.view.pan(now[0] - before[0], now[1] - before[1]);
      else return;
      moved += 1;
      pointers.set(e.pointerId, now);
    });
    canvas.addEventListener("pointerup", e => {
      if (this.rings.marker && this.own && !moved) this.rings.aim(this.view.place(e.offsetX, e.offsetY), this.own);
    });
    for (const end of ["pointerup", "pointercancel"]) canvas.addEventListener(end, e => pointers.delete(e.pointerId));
    section.querySelector('[data-zoom="in"]').onclick = () => this.zoom(1.5);
    section.querySelector('[data-zoom="out"]').onclick = () => this.zoom(1 / 1.5);
    section.querySelector('[data-zoom="centre"]').onclick = () => { this.view.follow = true; };
    section.querySelector('[data-zoom="up"]').onclick = () => this.view.next(this.own);
    section.querySelector('[data-zoom="marker"]').onclick = () => this.marker();
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
