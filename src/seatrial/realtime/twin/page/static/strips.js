// Innovations: each channel over time between limits of three standard deviations, and their size by hour in its band.

import { fitted } from "./shared/canvas.js";

const NAMES = { x: "north", y: "east", psi: "compass", r: "rate gyro", u_w: "log", v_north: "velocity north", v_east: "velocity east" };
const MOST = 5;

export class Strips {
  constructor(section, colours) { this.canvas = section.querySelector("canvas"); this.colours = colours; this.said = null; }

  show(said) { this.said = said; }

  draw() {
    if (!this.said) return;
    const { g, width, height } = fitted(this.canvas), c = this.colours(), all = Object.entries(this.said.misses);
    g.clearRect(0, 0, width, height);
    const left = Math.min(110, width * 0.28), each = height / Math.max(all.length, 1), end = this.said.t;
    const begin = Math.min(...all.map(([, some]) => some[0][0]), end - 1);
    g.font = "12px system-ui, sans-serif"; g.textBaseline = "middle";
    all.forEach(([channel, some], k) => {
      const middle = (k + 0.5) * each, up = 0.42 * each / MOST, masked = this.said.masked.includes(channel);
      g.fillStyle = masked ? c.ordered : c.ink; g.fillText(NAMES[channel] ?? channel, 0, middle);
      g.strokeStyle = c.line; g.lineWidth = 1; g.setLineDash([]); rule(g, left, middle, width, middle);
      g.setLineDash([3, 4]); for (const limit of [-3, 3]) rule(g, left, middle - limit * up, width, middle - limit * up);
      g.setLineDash([]); g.fillStyle = masked ? c.ordered : c.actual;
      for (const [t, size] of some) {
        const x = left + (width - left - 2) * (t - begin) / (end - begin), y = middle - Math.max(-MOST, Math.min(MOST, size)) * up;
        g.fillRect(x - 1, y - 1, 2.4, 2.4);
      }
    });
    g.textBaseline = "alphabetic";
  }
}

export class Hours {
  constructor(canvas, colours) { this.canvas = canvas; this.colours = colours; this.said = null; }

  show(said) { this.said = said; }

  draw() {
    if (!this.said) return;
    const { g, width, height } = fitted(this.canvas), c = this.colours(), hours = this.said.hours;
    g.clearRect(0, 0, width, height);
    if (!hours.length) return;
    const most = Math.max(1.25, ...hours.map(([, mean]) => Math.min(mean, 4))) * 1.05, left = 30, foot = height - 18, y = value => foot - (foot - 4) * Math.min(value, most) / most;
    const each = Math.min((width - left) / Math.max(hours.length, 6), 60);
    g.font = "12px system-ui, sans-serif"; g.fillStyle = c.muted;
    g.fillText("1", 8, y(1) + 4); g.fillText("0", 8, foot);
    hours.forEach(([start, mean, low, high], k) => {
      const x = left + k * each, inside = mean >= low && mean <= high;
      g.fillStyle = inside ? c.actual : c.ordered; g.fillRect(x + 2, y(mean), each - 4, foot - y(mean));
      g.strokeStyle = c.ink; g.lineWidth = 1.5; for (const edge of [low, high]) { rule(g, x, y(edge), x + each, y(edge)); }
      g.fillStyle = c.muted; if (hours.length < 10 || k % 3 === 0) g.fillText(`${Math.floor(start)} h`, x + 2, height - 4);
    });
    g.strokeStyle = c.line; rule(g, left, foot, width, foot);
  }
}

function rule(g, x, y, to, down) { g.beginPath(); g.moveTo(x, y); g.lineTo(to, down); g.stroke(); }
