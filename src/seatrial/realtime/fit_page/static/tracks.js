// Tracks side by side, each north up with equal scales to the north and to the east.

import { fitted, nice } from "./shared/canvas.js";

export class Tracks {
  constructor(section, colours) {
    this.section = section; this.canvas = section.querySelector("canvas"); this.colours = colours;
    this.measured = []; this.predicted = [];
  }

  begin(part) {
    this.measured = part.measured; this.predicted = [];
    this.restart = part.restart;
    this.show(null);
  }

  show(found) {
    this.predicted = found?.predicted ?? [];
    const often = this.restart === null || this.restart === undefined ? "" : `, reset to the measured state every ${this.restart} s`;
    this.section.querySelector("#who").textContent = found ? `predicted, iteration ${found.iteration}${often}` : "predicted: none yet";
    const untold = this.section.querySelector("#untold");
    untold.textContent = this.predicted.filter(one => one.failed).map(one => one.failed).join("; ");
    untold.hidden = !untold.textContent;
  }

  draw() {
    const { g, width, height } = fitted(this.canvas), c = this.colours();
    g.clearRect(0, 0, width, height);
    const count = this.measured.length;
    if (!count || !width || !height) return;
    const across = width > 1.1 * height || count === 1;
    this.measured.forEach((one, k) => {
      const w = across ? width / count : width, h = across ? height : height / count;
      this.#frame(g, c, one, this.predicted[k]?.track ?? [], across ? k * w : 0, across ? 0 : k * h, w, h);
    });
  }

  #frame(g, c, one, predicted, x0, y0, w, h) {
    const track = one.track, points = track.filter(Boolean);
    g.font = "12px system-ui, sans-serif"; g.fillStyle = c.ink; g.textAlign = "left";
    g.fillText(cut(g, one.name, w - 34), x0 + 4, y0 + 12);
    if (!points.length) return;
    const seen = box(points), room = Math.max(seen.high - seen.low, seen.right - seen.left, 1e-6);
    const also = box([...points, ...predicted.filter(p => p && near(p, seen, room))]);
    const left = x0 + 6, top = y0 + 20, wide = w - 12, high = h - 42;
    const metre = Math.min(wide / Math.max(also.right - also.left, 1e-6), high / Math.max(also.high - also.low, 1e-6)) * 0.96;
    const at = ([x, y]) => [left + wide / 2 + (y - (also.left + also.right) / 2) * metre, top + high / 2 - (x - (also.low + also.high) / 2) * metre];
    g.save(); g.beginPath(); g.rect(x0, y0 + 16, w, h - 16); g.clip();
    grid(g, c, at, metre, also, left, top, wide, high);
    stroke(g, track.map(p => p && at(p)), c.actual, 2, []);
    stroke(g, predicted.map(p => p && at(p)), c.ordered, 2.5, [6, 4]);
    const [sx, sy] = at(points[0]);
    g.strokeStyle = c.actual; g.lineWidth = 2; g.beginPath(); g.arc(sx, sy, 5, 0, 7); g.stroke();
    g.restore();
    north(g, c, x0 + w - 14, y0 + 16);
    scale(g, c, metre, left, y0 + h - 6, wide);
  }
}

const near = ([x, y], seen, room) => x > seen.low - room && x < seen.high + room && y > seen.left - room && y < seen.right + room;

function box(points) {
  const out = { low: Infinity, high: -Infinity, left: Infinity, right: -Infinity };
  for (const [x, y] of points) {
    out.low = Math.min(out.low, x); out.high = Math.max(out.high, x); out.left = Math.min(out.left, y); out.right = Math.max(out.right, y);
  }
  return out;
}

function stroke(g, points, colour, width, dash) {
  g.strokeStyle = colour; g.lineWidth = width; g.setLineDash(dash); g.lineJoin = "round"; g.beginPath();
  let open = false;
  for (const p of points) {
    if (p && open) g.lineTo(p[0], p[1]); else if (p) g.moveTo(p[0], p[1]);
    open = Boolean(p);
  }
  g.stroke(); g.setLineDash([]);
}

function grid(g, c, at, metre, seen, left, top, wide, high) {
  const step = nice(70 / metre), [cx, cy] = at([0, 0]);
  g.strokeStyle = c.line; g.lineWidth = 1; g.setLineDash([]); g.beginPath();
  for (let k = Math.ceil((left - cx) / (step * metre)); cx + k * step * metre <= left + wide; k += 1) { const x = Math.round(cx + k * step * metre) + 0.5; g.moveTo(x, top); g.lineTo(x, top + high); }
  for (let k = Math.ceil((top - cy) / (step * metre)); cy + k * step * metre <= top + high; k += 1) { const y = Math.round(cy + k * step * metre) + 0.5; g.moveTo(left, y); g.lineTo(left + wide, y); }
  g.stroke();
}

function north(g, c, x, y) {
  g.strokeStyle = g.fillStyle = c.ink; g.lineWidth = 1.5; g.textAlign = "center"; g.font = "11px system-ui, sans-serif";
  g.beginPath(); g.moveTo(x, y + 18); g.lineTo(x, y); g.moveTo(x - 4, y + 6); g.lineTo(x, y); g.lineTo(x + 4, y + 6); g.stroke();
  g.fillText("N", x, y - 4);
}

function scale(g, c, metre, left, y, wide) {
  const step = nice(Math.min(70, wide / 3) / metre), long = step * metre;
  g.strokeStyle = g.fillStyle = c.ink; g.lineWidth = 1.5; g.textAlign = "left"; g.font = "12px system-ui, sans-serif";
  g.beginPath(); g.moveTo(left, y - 4); g.lineTo(left, y); g.lineTo(left + long, y); g.lineTo(left + long, y - 4); g.stroke();
  g.fillText(step >= 1000 ? `${step / 1000} km` : `${step} m`, left + long + 6, y);
}

function cut(g, text, wide) {
  if (g.measureText(text).width <= wide) return text;
  let n = text.length;
  while (n > 4 && g.measureText(`${text.slice(0, n)}…`).width > wide) n -= 1;
  return `${text.slice(0, n)}…`;
}
