// Strips: rudder, heading, rate of turn and speed over the last minutes.

import { DEGREE, KNOT, clock, fixed } from "./units.js";

const ROWS = [
  { name: "Rudder", unit: "°", read: s => s.rudder / DEGREE, asked: s => s.asked / DEGREE, least: 20, even: true },
  { name: "Heading", unit: "°", read: s => s.psi / DEGREE, least: 10, round: 360 },
  { name: "Rate of turn", unit: "°/min", read: s => s.r * 60 / DEGREE, least: 2, even: true },
  { name: "Speed", unit: "kn", read: s => s.U / KNOT, least: 1 },
];

export class Strips {
  constructor(section, colours) {
    this.canvas = section.querySelector("canvas"); this.colours = colours; this.samples = []; this.drawn = 0;
  }

  begin(hello) {
    const rudder = hello.orders.find(o => o.name === "delta") ?? hello.orders.find(o => o.name.startsWith("delta"));
    this.rudder = rudder?.name;
    this.span = 10 * hello.ship.L / Math.max(hello.speed, 1e-3);
    this.samples = hello.trail.map(([t, , , psi, u, v, r, angle]) => ({ t, psi, U: Math.hypot(u, v), r, rudder: angle, asked: NaN }));
  }

  clear() { this.samples = []; }

  keep(frame) {
    const end = this.samples.at(-1);
    if (end && frame.t - end.t < this.span / 600) return;
    const [, , psi, u, v, r] = frame.own;
    this.samples.push({ t: frame.t, psi, U: Math.hypot(u, v), r, rudder: frame.act[this.rudder] ?? 0, asked: frame.ord[this.rudder] ?? 0 });
    const first = this.samples.findIndex(s => s.t > frame.t - this.span);
    if (first > 200) this.samples.splice(0, first);
  }

  /** Ten times a second is enough for what creeps. */
  draw(now, t) {
    if (now - this.drawn < 100) return;
    this.drawn = now;
    const ratio = Math.min(devicePixelRatio || 1, 2), canvas = this.canvas, width = canvas.clientWidth, height = canvas.clientHeight;
    if (!width || !height) return;
    if (canvas.width !== Math.round(width * ratio) || canvas.height !== Math.round(height * ratio)) {
      canvas.width = Math.round(width * ratio); canvas.height = Math.round(height * ratio);
    }
    const g = canvas.getContext("2d"), c = this.colours();
    g.setTransform(ratio, 0, 0, ratio, 0, 0);
    g.clearRect(0, 0, width, height);
    const columns = width > 900 || (width > 480 && height < 220) ? 4 : width > 480 ? 2 : 1, rows = ROWS.length / columns;
    const seen = this.samples.filter(s => s.t >= t - this.span && s.t <= t + 1e-6);
    ROWS.forEach((row, k) => {
      const w = width / columns, h = height / rows;
      this.#strip(g, c, row, seen, t, (k % columns) * w + 4, Math.floor(k / columns) * h, w - 10, h - 4);
    });
  }

  #strip(g, c, row, seen, t, x0, y0, w, h) {
    const left = x0 + 44, top = y0 + 18, wide = w - 44, high = h - 34;
    const [low, top_] = range(seen, row);
    const px = s => left + wide * (1 - (t - s.t) / this.span), py = value => top + high * (top_ - value) / (top_ - low);
    g.font = "12px system-ui, sans-serif"; g.fillStyle = c.ink; g.textAlign = "left";
    g.fillText(`${row.name} [${row.unit}]`, left, y0 + 12);
    g.fillStyle = c.muted; g.strokeStyle = c.line; g.lineWidth = 1; g.textAlign = "right";
    for (const value of [low, (low + top_) / 2, top_]) {
      const y = Math.round(py(value)) + 0.5, digits = top_ - low < 4 ? 1 : 0;
      g.beginPath(); g.moveTo(left, y); g.lineTo(left + wide, y); g.stroke();
      g.fillText(fixed(row.round ? ((value % row.round) + row.round) % row.round : value, digits), left - 5, y + 4);
    }
    if (wide > 200) g.fillText(`${clock(this.span)} back`, left + wide, y0 + 12);
    g.textAlign = "left";
    g.save(); g.beginPath(); g.rect(left, top - 2, wide, high + 4); g.clip();
    const line = (read, colour, dash, width) => {
      g.strokeStyle = colour; g.setLineDash(dash); g.lineWidth = width; g.beginPath();
      for (const s of seen) { const value = read(s); if (!Number.isNaN(value)) g.lineTo(px(s), py(value)); }
      g.stroke(); g.setLineDash([]);
    };
    if (row.asked) line(row.asked, c.ordered, [5, 3], 1.5);
    line(row.read, c.actual, [], 2);
    g.restore();
  }
}

function range(seen, row) {
  const values = seen.flatMap(s => row.asked ? [row.read(s), row.asked(s)] : [row.read(s)]).filter(Number.isFinite);
  let low = Math.min(...values, Infinity), high = Math.max(...values, -Infinity);
  if (!values.length) [low, high] = [0, 0];
  if (row.even) { high = Math.max(Math.abs(low), Math.abs(high), row.least); low = -high; }
  if (high - low < row.least) { const middle = (low + high) / 2; low = middle - row.least / 2; high = middle + row.least / 2; }
  const grain = row.least / 2;
  return [Math.floor(low / grain) * grain, Math.ceil(high / grain) * grain];
}
