// Objective against iteration, and below it the validation loss at the same iterations.

import { fitted, nice } from "./shared/canvas.js";

export class Curves {
  constructor(section, colours) {
    this.canvas = section.querySelector("canvas"); this.none = section.querySelector("#none-yet"); this.colours = colours;
    this.rows = []; this.end = null;
  }

  begin() { this.rows = []; this.end = null; }

  add(rows, end, anew) {
    if (anew) this.rows = [];
    this.rows.push(...rows);
    this.end = end;
  }

  draw() {
    this.none.hidden = this.end !== null;
    const { g, width, height } = fitted(this.canvas), c = this.colours();
    g.clearRect(0, 0, width, height);
    if (!width || !height || this.end === null) return;
    const rows = this.rows.at(-1)?.[0] === this.end[0] ? this.rows : [...this.rows, this.end];
    const watched = rows.some(row => row[2] !== null), below = 18, high = (height - below) / (watched ? 2 : 1);
    const from = rows[0][0] > 1 ? rows[0][0] : 1, to = Math.max(rows.at(-1)[0], from + 1);
    const left = 58, wide = width - left - 10, px = iteration => left + wide * (iteration - from) / (to - from);
    this.#panel(g, c, rows.map(row => [row[0], row[1]]), "objective", px, left, wide, 0, high, c.actual, []);
    if (watched) this.#panel(g, c, rows.map(row => [row[0], row[2]]), "validation", px, left, wide, high, high, c.ordered, [7, 3]);
    g.fillStyle = c.muted; g.textAlign = "center"; g.font = "12px system-ui, sans-serif";
    const step = Math.max(nice((to - from) / Math.max(wide / 70, 1)), 1);
    for (let k = Math.ceil(from / step) * step; k <= to; k += step) g.fillText(String(k), px(k), height - 4);
    if (from % step !== 0 && px(Math.ceil(from / step) * step) - px(from) > 24) g.fillText(String(from), px(from), height - 4);
  }

  #panel(g, c, points, name, px, left, wide, top, high, colour, dash) {
    const values = points.map(p => p[1]).filter(value => value !== null), y0 = top + 18, y1 = top + high - 6;
    const least = Math.min(...values), most = Math.max(...values), log = least > 0 && most > 8 * least;
    g.font = "12px system-ui, sans-serif"; g.textAlign = "left"; g.fillStyle = colour;
    g.fillText(`${name}${log ? " (logarithmic)" : ""}`, left, top + 11);
    const to = log ? Math.log10 : value => value;
    let low = to(least), up = to(most);
    if (!values.length) return;
    if (up - low < 1e-9 * Math.max(Math.abs(up), 1e-9)) { const room = Math.abs(up) * 0.01 || 1; low -= room; up += room; }
    const py = value => y1 - (y1 - y0) * (to(value) - low) / (up - low);
    g.textAlign = "right"; g.lineWidth = 1; g.setLineDash([]);
    for (const value of log ? decades(low, up) : steps(low, up, Math.max((y1 - y0) / 28, 1))) {
      const y = Math.round(py(value)) + 0.5;
      if (y < y0 - 1 || y > y1 + 1) continue;
      g.strokeStyle = c.line; g.beginPath(); g.moveTo(left, y); g.lineTo(left + wide, y); g.stroke();
      g.fillStyle = c.muted; g.fillText(short(value), left - 5, y + 4);
    }
    g.strokeStyle = colour; g.lineWidth = 2; g.setLineDash(dash); g.beginPath();
    let open = false;
    for (const [iteration, value] of points) {
      if (value === null) { open = false; continue; }
      if (open) g.lineTo(px(iteration), py(value)); else g.moveTo(px(iteration), py(value));
      open = true;
    }
    g.stroke(); g.setLineDash([]);
    g.fillStyle = colour;
    const dots = points.length <= 60 ? points : points.slice(-1);
    for (const [iteration, value] of dots) if (value !== null) { g.beginPath(); g.arc(px(iteration), py(value), 3, 0, 7); g.fill(); }
  }
}

function steps(low, up, count) {
  const step = nice((up - low) / count), out = [];
  for (let k = Math.ceil(low / step - 1e-9); k * step <= up + 1e-9 * step; k += 1) out.push(k * step);
  return out;
}

function decades(low, up) {
  const marks = up - low > 2 ? [1] : [1, 2, 5], out = [];
  for (let k = Math.floor(low); k <= Math.ceil(up); k += 1) out.push(...marks.map(m => m * 10 ** k));
  return out;
}

const short = value => {
  const size = Math.abs(value);
  const text = size !== 0 && (size >= 1e5 || size < 1e-3) ? value.toExponential(1).replace("e+", "e") : String(Number(value.toPrecision(5)));
  return text.replace("-", "−");
};
