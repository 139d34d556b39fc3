// The window of the chart: where a place on earth is on the screen, with the ship's head, its course or north up.

import { course } from "./shared/units.js";

export const UPS = ["north", "head", "course"];

export class View {
  constructor() { this.follow = true; this.centre = [0, 0]; this.metre = null; this.up = UPS[0]; this.turned = 0; this.width = 0; this.height = 0; }

  #kept = 0; #c = 1; #s = 0;

  /** Choose what is up; course-up keeps the course over ground of this moment, and takes the present one if it is
   *  chosen again after the others. */
  turn(up, own) {
    const [, , psi, u, v] = own ?? [0, 0, 0, 0, 0];
    this.up = up;
    this.#kept = Math.hypot(u, v) > 1e-3 ? psi + Math.atan2(v, u) : psi;
  }

  next(own) { this.turn(UPS[(UPS.indexOf(this.up) + 1) % UPS.length], own); }

  /** Words for what is up. */
  get says() { return this.up === "course" ? `Course up ${course(this.#kept).slice(0, 3)}°` : this.up === "head" ? "Head up" : "North up"; }

  /** Set the size and the direction that is up for the next drawing. */
  fit(width, height, own) {
    this.width = width; this.height = height;
    this.turned = this.up === "head" ? own[2] : this.up === "course" ? this.#kept : 0;
    this.#c = Math.cos(this.turned); this.#s = Math.sin(this.turned);
    if (this.follow) this.centre = [own[0], own[1]];
  }

  /** Pixel of a place [m north, m east]. */
  at(x, y) {
    const north = (x - this.centre[0]) * this.metre, east = (y - this.centre[1]) * this.metre;
    const c = this.#c, s = this.#s;
    return [this.width / 2 + east * c - north * s, this.height / 2 - north * c - east * s];
  }

  /** Place of a pixel; the inverse of `at`. */
  place(px, py) {
    const [dx, dy] = this.shift(px - this.width / 2, py - this.height / 2);
    return [this.centre[0] + dx, this.centre[1] + dy];
  }

  /** Metres north and east of a way on the screen. */
  shift(right, down) {
    const c = this.#c, s = this.#s;
    return [(-right * s - down * c) / this.metre, (right * c - down * s) / this.metre];
  }

  /** Zoom about a pixel, the middle if there is none. */
  zoom(by, L, at = null) {
    const [px, py] = at ?? [this.width / 2, this.height / 2], low = 2 / L;
    const before = this.place(px, py);
    this.metre = Math.min(Math.max(this.metre * by, low / 200), low * 300);
    if (this.follow) return;
    const after = this.place(px, py);
    this.centre = [this.centre[0] + before[0] - after[0], this.centre[1] + before[1] - after[1]];
  }

  pan(right, down) {
    const [north, east] = this.shift(right, down);
    this.follow = false;
    this.centre = [this.centre[0] - north, this.centre[1] - east];
  }

  /** Radius that contains the whole window [m]. */
  get reach() { return Math.hypot(this.width, this.height) / 2 / this.metre; }
}
