// The chart that the user brings: depths, banks, quays and fairways; and the route of the own ship.

import { font, scale } from "./shared/canvas.js";

const SHALLOW = 1.5;  // depth over draught below which water is drawn as shoal

export class Land {
  begin(hello) {
    this.chart = hello.chart;
    this.route = hello.range?.route ?? [];
    this.shoal = SHALLOW * (hello.draught || 0);
  }

  draw(g, view, leg, c) {
    if (this.chart) this.#chart(g, view, c);
    if (this.route.length > 1) this.#route(g, view, leg, c);
  }

  #path(g, view, points, closed) {
    g.beginPath();
    for (const [x, y] of points) g.lineTo(...view.at(x, y));
    if (closed) g.closePath();
  }

  #chart(g, view, c) {
    const k = scale();
    g.setLineDash([]); g.font = font(11); g.lineJoin = "round";
    for (const points of this.chart.land) {
      this.#path(g, view, points, true);
      g.fillStyle = c.land; g.fill(); g.strokeStyle = c.ink; g.lineWidth = 1.5 * k; g.stroke();
    }
    for (const [points, depth] of this.chart.areas) {
      this.#path(g, view, points, true);
      g.fillStyle = depth < this.shoal ? c.shoal : c.water; g.fill();
      g.strokeStyle = c.muted; g.lineWidth = k; g.stroke();
      const seen = points.map(([x, y]) => view.at(x, y)), mean = axis => seen.reduce((sum, p) => sum + p[axis], 0) / seen.length;
      g.fillStyle = c.muted; g.fillText(`${Number(depth.toPrecision(3))} m`, mean(0), mean(1));
    }
    for (const [points, width, dash] of [...this.chart.coasts.map(p => [p, 1.5, []]), ...this.chart.banks.map(p => [p, 2, []]),
      ...this.chart.quays.map(p => [p, 5, []]), ...this.chart.fairways.map(p => [p, 1.5, [12, 6]])]) {
      this.#path(g, view, points, false);
      g.strokeStyle = dash.length ? c.muted : c.ink; g.lineWidth = width * k; g.setLineDash(dash); g.stroke();
    }
    g.setLineDash([]);
  }

  /** Waypoints with their numbers; the leg that is followed is drawn bold. */
  #route(g, view, leg, c) {
    const k = scale();
    g.strokeStyle = g.fillStyle = c.ordered; g.font = font(12);
    this.route.forEach(([x, y], n) => {
      const [px, py] = view.at(x, y);
      if (n) {
        g.lineWidth = (n - 1 === leg ? 2.5 : 1.2) * k; g.setLineDash([14, 4, 2, 4]);
        g.beginPath(); g.moveTo(...view.at(...this.route[n - 1])); g.lineTo(px, py); g.stroke(); g.setLineDash([]);
      }
      g.lineWidth = 1.5 * k;
      g.beginPath(); g.arc(px, py, 6 * k, 0, 2 * Math.PI); g.stroke();
      if (n) g.fillText(`WP ${n}`, px + 9 * k, py - 7 * k);
    });
  }
}
