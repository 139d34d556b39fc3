// The chart: measured fixes, estimated track, the ship to scale, and the predicted track with its band; equal scales.

import { fitted, nice } from "./shared/canvas.js";

export class Chart {
  constructor(section, colours) { this.canvas = section.querySelector("canvas"); this.colours = colours; this.said = null; }

  show(said) { this.said = said; }

  draw() {
    if (!this.said) return;
    const { g, width, height } = fitted(this.canvas), c = this.colours(), said = this.said;
    g.clearRect(0, 0, width, height); g.fillStyle = c.water; g.fillRect(0, 0, width, height);
    const at = this.scale(said, width, height);
    this.grid(g, c, at, width, height);
    this.band(g, c, at, said.ahead);
    this.way(g, said.ahead.map(([, n, e]) => [n, e]), at, c.ordered, 2.5, [8, 5]);
    g.fillStyle = c.card; g.strokeStyle = c.actual; g.lineWidth = 1.5;
    for (const point of this.apart(said.measured, at)) { const [px, py] = at(point); g.beginPath(); g.arc(px, py, 3.5, 0, 7); g.fill(); g.stroke(); }
    this.way(g, said.estimated, at, c.ink, 2, []);
    this.ship(g, c, at, said);
    this.marks(g, c, at, said.ahead);
  }

  /** Points that do not cover each other, the last ones first. */
  apart(points, at) {
    const kept = [];
    for (const point of [...points].reverse()) {
      const [x, y] = at(point);
      if (!kept.some(([, px, py]) => Math.hypot(x - px, y - py) < 9)) kept.push([point, x, y]);
    }
    return kept.map(([point]) => point);
  }

  scale(said, width, height) {
    const points = [...said.estimated.slice(-160), ...said.ahead.flatMap(([, n, e, across]) => [[n - across, e - across], [n + across, e + across]])], north = points.map(p => p[0]), east = points.map(p => p[1]);
    const low = [Math.min(...north), Math.min(...east)], high = [Math.max(...north), Math.max(...east)];
    this.perMetre = Math.min((height - 60) / Math.max(high[0] - low[0], 3 * said.L), (width - 60) / Math.max(high[1] - low[1], 3 * said.L));
    this.middle = [(low[0] + high[0]) / 2, (low[1] + high[1]) / 2];
    return ([n, e]) => [width / 2 + (e - this.middle[1]) * this.perMetre, height / 2 - (n - this.middle[0]) * this.perMetre];
  }

  grid(g, c, at, width, height) {
    const step = nice(90 / this.perMetre);
    g.strokeStyle = c.line; g.lineWidth = 1; g.fillStyle = c.muted; g.font = "12px system-ui, sans-serif"; g.setLineDash([]);
    const [left, top] = [this.middle[1] - width / 2 / this.perMetre, this.middle[0] + height / 2 / this.perMetre];
    for (let e = Math.ceil(left / step) * step; e < left + width / this.perMetre; e += step) { const [x] = at([0, e]); rule(g, x, 0, x, height); }
    for (let n = Math.floor(top / step) * step; n > top - height / this.perMetre; n -= step) { const [, y] = at([n, 0]); rule(g, 0, y, width, y); }
    const long = step * this.perMetre;
    g.strokeStyle = c.ink; g.lineWidth = 2; rule(g, 12, height - 12, 12 + long, height - 12);
    g.fillStyle = c.ink; g.fillText(step >= 1000 ? `${step / 1000} km` : `${step} m`, 14, height - 18);
    g.fillText("N ↑", width - 34, 18);
  }

  band(g, c, at, ahead) {
    const side = sign => ahead.map(([, n, e, across], k) => {
      const [a, b] = [ahead[Math.max(k - 1, 0)], ahead[Math.min(k + 1, ahead.length - 1)]];
      const course = Math.atan2(b[2] - a[2], b[1] - a[1]);
      return at([n - sign * across * Math.sin(course), e + sign * across * Math.cos(course)]);
    });
    const edge = [...side(1), ...side(-1).reverse()];
    g.fillStyle = c.band; g.globalAlpha = 0.75; g.beginPath();
    edge.forEach(([x, y], k) => k ? g.lineTo(x, y) : g.moveTo(x, y));
    g.closePath(); g.fill(); g.globalAlpha = 1;
  }

  way(g, points, at, colour, width, dash) {
    g.strokeStyle = colour; g.lineWidth = width; g.setLineDash(dash); g.beginPath();
    points.forEach((point, k) => { const [x, y] = at(point); k ? g.lineTo(x, y) : g.moveTo(x, y); });
    g.stroke(); g.setLineDash([]);
  }

  ship(g, c, at, said) {
    const [x, y] = at([said.state.x[0], said.state.y[0]]), long = Math.max(said.L * this.perMetre, 22), wide = Math.max(said.B * this.perMetre, long / 6);
    g.save(); g.translate(x, y); g.rotate(said.state.psi[0]);
    g.beginPath(); g.moveTo(0, -long / 2); g.quadraticCurveTo(wide / 2, -long / 4, wide / 2, 0); g.lineTo(wide / 2, long / 2); g.lineTo(-wide / 2, long / 2); g.lineTo(-wide / 2, 0); g.quadraticCurveTo(-wide / 2, -long / 4, 0, -long / 2); g.closePath();
    g.fillStyle = c.card; g.strokeStyle = c.ink; g.lineWidth = 2; g.fill(); g.stroke(); g.restore();
  }

  marks(g, c, at, ahead) {
    g.font = "12px system-ui, sans-serif";
    for (const [seconds, text] of [[30, "30 s"], [120, "2 min"], [300, "5 min"], [600, "10 min"]]) {
      const near = ahead.reduce((best, one) => Math.abs(one[0] - seconds) < Math.abs(best[0] - seconds) ? one : best);
      if (Math.abs(near[0] - seconds) > 0.1 * seconds) continue;
      const [x, y] = at([near[1], near[2]]);
      g.fillStyle = c.ordered; g.beginPath(); g.arc(x, y, 4, 0, 7); g.fill();
      g.fillStyle = c.ink; g.fillText(text, x + 7, y - 6);
    }
  }
}

function rule(g, x, y, to, down) { g.beginPath(); g.moveTo(x, y); g.lineTo(to, down); g.stroke(); }
