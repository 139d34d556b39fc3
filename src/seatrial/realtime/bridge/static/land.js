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
    for (const [points, depth, holes] of this.chart.areas) {
      g.beginPath();
      for (const ring of [points, ...holes]) {
        ring.forEach(([x, y], n) => n ? g.lineTo(...view.at(x, y)) : g.moveTo(...view.at(x, y)));
        g.closePath();
      }
      g.fillStyle = depth === 0 ? c.land : depth < this.shoal ? c.shoal : c.water; g.fill("evenodd");
      g.strokeStyle = c.muted; g.lineWidth = k; g.stroke();
      if (depth === 0) continue;
      const seen = points.map(([x, y]) => view.at(x, y)), mean = axis => seen.reduce((sum, p) => sum + p[axis], 0) / seen.length;
      g.fillStyle = c.muted; g.fillText(`${Number(depth.toPrecision(3))} m`, mean(0), mean(1));
    }
    for (const [points, width, dash] of [...this.chart.coasts.map(p => [p, 1.5, []]), ...this.chart.banks.map(p => [p, 2, []]),
      ...this.chart.quays.map(p => [p, 5, []]), ...this.chart.fairways.map(p => [p, 1.5, [12, 6]])]) {
      this.#path(g, view, points, false);
      g.strokeStyle = dash.length ? c.muted : c.ink; g.lineWidth = width * k; g.setLineDash(dash); g.stroke();
    }
    g.setLineDash([]);
    for (const [x, y, depth] of this.chart.spots) this.#spot(g, view.at(x, y), depth, c);
  }

  /** A danger with the water above it, or a buoy or beacon, which has no depth. */
  #spot(g, [x, y], depth, c) {
    const k = scale(), r = 5 * k;
    g.strokeStyle = g.fillStyle = c.ink; g.lineWidth = 1.5 * k;
    g.beginPath();
    if (depth === null) {
      g.arc(x, y, 0.6 * r, 0, 2 * Math.PI); g.stroke();
    } else {
      g.moveTo(x - r, y); g.lineTo(x + r, y); g.moveTo(x, y - r); g.lineTo(x, y + r); g.stroke();
      g.fillText(Number(depth.toPrecision(2)), x + r, y - r);
    }
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
