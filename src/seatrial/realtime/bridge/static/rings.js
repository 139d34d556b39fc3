// Range rings with a bearing scale, an electronic bearing line and a variable range marker, about the own ship.

import { font, scale } from "./shared/canvas.js";
import { DEGREE, MILE, course, miles, sided } from "./shared/units.js";

const WHOLE = 3, MOST = 8;  // rings that are seen whole in a window with the ship in its middle, and that are drawn

export class Rings {
  constructor() { this.shown = true; this.marker = false; this.bearing = 0; this.range = 0; }

  /** Distance between two rings [m]: the greatest round number of nautical miles that lets the window hold three. */
  static apart(view) {
    const most = 0.86 * Math.min(view.width, view.height) / view.metre / 2 / WHOLE / MILE, decade = 10 ** Math.floor(Math.log10(most));
    return [5, 2.5, 2, 1].map(m => m * decade).find(step => step <= most * (1 + 1e-9)) * MILE;
  }

  /** Turn the bearing line on or off; it begins ahead of the ship at the second ring. */
  toggle(own, view) {
    this.marker = !this.marker;
    if (this.marker && !this.range) { this.bearing = own[2]; this.range = 2 * Rings.apart(view); }
  }

  /** Move bearing line [degrees] and range marker [share of the distance between rings]. */
  move(degrees, share, view) {
    this.bearing += degrees * DEGREE;
    this.range = Math.max(this.range + share * Rings.apart(view), 0);
  }

  /** Set both to a place. */
  aim([x, y], own) {
    this.bearing = Math.atan2(y - own[1], x - own[0]);
    this.range = Math.hypot(x - own[0], y - own[1]);
  }

  /** What the marker reads: true and relative bearing, and distance. */
  says(own) {
    const relative = Math.atan2(Math.sin(this.bearing - own[2]), Math.cos(this.bearing - own[2]));
    return `EBL ${course(this.bearing)}° T, ${sided(relative / DEGREE, 1, "°")} · VRM ${miles(this.range)}`;
  }

  draw(g, view, own, c) {
    const [x, y] = view.at(own[0], own[1]);
    if (this.shown) this.#rings(g, view, own, x, y, c);
    if (!this.marker) return;
    g.strokeStyle = c.ink; g.lineWidth = 1.5 * scale(); g.setLineDash([10, 5]);
    const far = 2 * view.reach * view.metre, angle = this.bearing - view.turned;
    g.beginPath(); g.moveTo(x, y); g.lineTo(x + far * Math.sin(angle), y - far * Math.cos(angle)); g.stroke();
    g.beginPath(); g.arc(x, y, this.range * view.metre, 0, 2 * Math.PI); g.stroke();
    g.setLineDash([]);
  }

  #rings(g, view, own, x, y, c) {
    const apart = Rings.apart(view), k = scale();
    g.strokeStyle = c.muted; g.fillStyle = c.muted; g.lineWidth = 1; g.font = font(12); g.globalAlpha = 0.55;
    for (let n = 1; n <= MOST; n += 1) { g.beginPath(); g.arc(x, y, n * apart * view.metre, 0, 2 * Math.PI); g.stroke(); }
    g.globalAlpha = 1;
    for (let n = 1; n < WHOLE; n += 1) g.fillText(miles(n * apart), x + 4 * k, y + n * apart * view.metre - 4 * k);
    const r = WHOLE * apart * view.metre;  // the outermost that is seen whole has the bearings
    g.textAlign = "center"; g.textBaseline = "middle";
    for (let degrees = 0; degrees < 360; degrees += 10) {
      const angle = degrees * DEGREE - view.turned, s = Math.sin(angle), q = -Math.cos(angle), long = degrees % 30 ? 5 : 9;
      g.beginPath(); g.moveTo(x + r * s, y + r * q); g.lineTo(x + (r + long * k) * s, y + (r + long * k) * q); g.stroke();
      if (degrees % 30 === 0) g.fillText(String(degrees).padStart(3, "0"), x + (r + 20 * k) * s, y + (r + 20 * k) * q);
    }
    g.textAlign = "left"; g.textBaseline = "alphabetic";
  }
}
