// Strips: rudder, heading, rate of turn and speed over the last minutes.

import { fitted, font, nice, scale } from "./shared/canvas.js";
import { DEGREE, KNOT, clock, fixed, shown, sided } from "./shared/units.js";

const ROWS = [
  { name: "Heading", unit: "°", read: s => s.psi / DEGREE, least: 10, round: 360 },
  { name: "Rate of turn", unit: "°/min", read: s => s.r * 60 / DEGREE, least: 2, even: true },
  { name: "Speed", unit: "kn", read: s => s.U / KNOT, least: 1, bottom: 0 },
];

export class Strips {
  constructor(section, colours) {
    this.canvas = section.querySelector("canvas"); this.colours = colours; this.samples = []; this.drawn = 0;
  }

  begin(hello) {
    const rudder = hello.orders.find(o => o.kind === "rudder"), [unit, factor] = shown(rudder?.unit ?? "rad");
    this.rudder = rudder?.name;
    const size = (rudder?.per ?? 1) * factor, least = unit === "°" ? 20 : (rudder?.high ?? 1) * size / 2;
    this.rows = [...(rudder ? [{ name: rudder.label, unit, read: s => s.rudder * size, asked: s => s.asked * size, least, even: true }] : []), ...ROWS];
    this.span = 10 * hello.ship.L / Math.max(hello.speed, 1e-3);
    this.samples = hello.trail.map(([t, , , psi, u, v, r, angle]) => ({ t, psi, U: Math.hypot(u, v), r, rudder: angle ?? NaN, asked: NaN }));
  }

  clear() { this.samples = []; }

  keep(frame) {
    const end = this.samples.at(-1);
    if (end && frame.t - end.t < this.span / 600) return;
    const [, , psi, u, v, r] = frame.own;
    this.samples.push({ t: frame.t, psi, U: Math.hypot(u, v), r, rudder: frame.act[this.rudder] ?? NaN, asked: frame.ord[this.rudder] ?? NaN });
    const first = this.samples.findIndex(s => s.t > frame.t - this.span);
    if (first > 200) this.samples.splice(0, first);
  }

  /** Draw at most ten times a second, which is enough for slow changes. */
  draw(now, t) {
    if (now - this.drawn < 100) return;
    this.drawn = now;
    if (!this.canvas.clientWidth || !this.canvas.clientHeight) return;
    const { g, width, height } = fitted(this.canvas), c = this.colours();
    g.clearRect(0, 0, width, height);
    const grown = scale(), columns = [1, 2, 4].find(n => height * n / 4 >= 88 * grown && (n > 1 || width < 560 * grown)) ?? (width > 560 * grown ? 4 : 2), rows = Math.ceil(this.rows.length / columns);
    const seen = this.samples.filter(s => s.t >= t - this.span && s.t <= t + 1e-6);
    this.rows.forEach((row, k) => {
      const w = width / columns, h = height / rows;
      this.#strip(g, c, row, seen, t, (k % columns) * w + 4, Math.floor(k / columns) * h, w - 10, h - 4);
    });
  }

  #strip(g, c, row, seen, t, x0, y0, w, h) {
    const k = scale(), left = x0 + 44 * k, top = y0 + 18 * k, wide = w - 44 * k, high = h - 34 * k;
    const [low, top_, step, round] = range(seen, row, Math.min(Math.max(Math.floor(high / 18 / k), 1), 4));
    const px = s => left + wide * (1 - (t - s.t) / this.span), py = value => top + high * (top_ - value) / (top_ - low);
    g.font = font(12); g.fillStyle = c.ink; g.textAlign = "left";
    g.fillText(`${row.name} [${row.unit}]`, left, y0 + 12 * k);
    g.fillStyle = c.muted; g.strokeStyle = c.line; g.lineWidth = 1; g.textAlign = "right";
    const digits = Math.max(0, -Math.floor(Math.log10(step) + 1e-9));
    for (let n = 0; n <= Math.round((top_ - low) / step); n += 1) {
      const value = low + n * step, y = Math.round(py(value)) + 0.5;
      g.beginPath(); g.moveTo(left, y); g.lineTo(left + wide, y); g.stroke();
      g.fillText(row.even ? sided(value, digits) : fixed(row.round && !round ? modulo(value, row.round) : value, digits), left - 5 * k, y + 4 * k);
    }
    if (wide > 200) g.fillText(`${clock(this.span)} back`, left + wide, y0 + 12 * k);
    g.textAlign = "left";
    g.save(); g.beginPath(); g.rect(left, top - 2, wide, high + 4); g.clip();
    const line = (read, colour, dash, width) => {
      g.strokeStyle = colour; g.setLineDash(dash); g.lineWidth = width; g.beginPath();
      let before = NaN;
      for (const s of seen) {
        const value = round ? modulo(read(s), round) : read(s);
        if (Number.isNaN(value)) continue;
        if (round && Math.abs(value - before) > round / 2) g.moveTo(px(s), py(value));  // crossing north: from edge to edge
        else g.lineTo(px(s), py(value));
        before = value;
      }
      g.stroke(); g.setLineDash([]);
    };
    if (row.asked) line(row.asked, c.ordered, [5, 3], 1.5);
    line(row.read, c.actual, [], 2);
    g.restore();
  }
}

const modulo = (value, round) => ((value % round) + round) % round;

/** Ends of an axis, both round numbers; the step between its lines (about `many` of them); and the full turn, if the
 *  values span more than half of it, else 0. */
function range(seen, row, many) {
  const values = seen.flatMap(s => row.asked ? [row.read(s), row.asked(s)] : [row.read(s)]).filter(Number.isFinite);
  let low = Math.min(...values, Infinity), high = Math.max(...values, -Infinity);
  if (!values.length) [low, high] = [0, 0];
  if (row.even) { high = Math.max(Math.abs(low), Math.abs(high), row.least / 2); low = -high; }
  if (high - low < row.least) { const middle = (low + high) / 2; low = middle - row.least / 2; high = middle + row.least / 2; }
  if (low < row.bottom) [low, high] = [row.bottom, Math.max(high, row.bottom + row.least)];
  if (row.round && high - low > row.round / 2) return [0, row.round, row.round / (many < 4 ? 2 : 4), row.round];
  const wanted = (high - low) / many * (1 - 1e-9);
  const step = row.round && wanted > 10 ? [15, 30, 45, 90, 180].find(n => n >= wanted) : nice(wanted);
  return [Math.floor(low / step + 1e-6) * step, Math.ceil(high / step - 1e-6) * step, step, 0];
}
