// Velocity vectors of all ships on the chart: where each will be after one time, the same for all, at its velocity now.

export const TIMES = [6, 15, 30, 60, 120, 180, 360, 720, 900, 1800];  // [s]

/** The time that suits a ship until another is chosen: in it the ship goes at least four of its lengths. */
export const usual = ({ L }, U) => TIMES.find(t => t >= 4 * L / Math.max(U, 1e-3)) ?? TIMES.at(-1);

/** A time as text. */
export const lasting = t => t < 60 ? `${t} s` : `${t / 60} min`;

/** Where a ship of a pose is after a time, at its present velocity over ground. */
export function reach([x, y, psi, u, v], t) {
  const c = Math.cos(psi), s = Math.sin(psi);
  return [x + (u * c - v * s) * t, y + (u * s + v * c) * t];
}

/** The time of the vectors, chosen from a menu or by a key; the ship's own unless another was chosen. */
export class Vectors {
  constructor(menu) {
    this.menu = menu;
    menu.replaceChildren(...TIMES.map(t => new Option(lasting(t), String(t))));
    menu.onchange = () => { this.chosen = true; menu.blur(); };
    this.chosen = false;
  }

  /** Seconds. */
  get time() { return Number(this.menu.value); }

  begin(ship, U) { if (!this.chosen) this.menu.value = String(usual(ship, U)); }

  /** The next longer time, or the next shorter one. */
  turn(way) {
    const k = TIMES.indexOf(this.time) + way;
    this.menu.value = String(TIMES[Math.min(Math.max(k, 0), TIMES.length - 1)]);
    this.chosen = true;
  }
}
