// The connection to the simulation: pictures in, requests out, and interpolation between two pictures.

import { line } from "./shared/line.js";

const KEY = "seatrial-bridge";
const DEEP = 40;

/** Age of the last picture from which it counts as out of date [s]. */
export const OLD = 2;

export class Link extends EventTarget {
  /** Hello and the last picture; null until they arrive. */
  hello = null;
  last = null;
  /** Number of pictures received. */
  pictures = 0;
  #say = () => {};
  #frames = [];
  #shown = null;
  #at = 0;
  #news = performance.now();
  #why = "";

  open() {
    this.#say = line({
      opened: () => this.ask({ hello: token(), key: decodeURIComponent(location.hash.slice(1)) }),
      hear: said => this.#take(said), broken: (why, ever) => this.#broken(why, ever),
    });
  }

  /** Send a request; it is discarded while there is no connection. */
  ask(request) {
    this.#say(request);
  }

  get commands() { return this.last !== null && this.hello !== null && this.last.command[0] === this.hello.hello && this.contact() === null; }

  /** Age of the last picture [s] and the reason why none follows; null while pictures arrive. */
  contact(now = performance.now()) {
    const age = Math.max(now - this.#news, 0) / 1000;
    if (this.#why) return { age, why: this.#why };
    return age > OLD ? { age, why: "no new data" } : null;
  }

  /** State to draw at a time of the display [ms], interpolated between two pictures for smooth motion. */
  between(now) {
    const last = this.last;
    if (last === null) return null;
    if (last.factor === null) return mix(last, last, 1, this.#shown = last.t);  // as fast as possible
    const step = Math.min(Math.max((now - this.#at) / 1000, 0), 0.25);
    this.#at = now;
    const delay = Math.max(0.1 * last.factor, 2 / this.hello.rate);
    const wanted = last.t - delay;
    if (this.#shown === null || Math.abs(this.#shown - wanted) > 8 * delay) this.#shown = wanted;
    else if (last.paused) this.#shown += (last.t - this.#shown) * 0.3;
    else this.#shown += step * last.factor + (wanted - this.#shown) * 0.03;
    const t = this.#shown = Math.min(this.#shown, last.t);
    const frames = this.#frames;
    let k = frames.length - 1;
    while (k > 0 && frames[k - 1].t > t) k -= 1;
    const b = frames[k], a = frames[Math.max(k - 1, 0)];
    const w = b.t > a.t ? Math.min(Math.max((t - a.t) / (b.t - a.t), 0), 1) : 1;
    return mix(a, b, w, t);
  }

  #take(said) {
    if (said.hello !== undefined) {
      this.hello = said;
      this.#why = "";
      this.#restart();
      this.#tell("hello");
    } else if (said.note !== undefined) {
      this.dispatchEvent(new CustomEvent("note", { detail: said.note }));
    } else {
      const back = this.last !== null && said.t < this.last.t;
      if (back) this.#restart();
      const fresh = this.last === null || said.t !== this.last.t;
      if (fresh || said.paused) this.#news = performance.now();
      this.last = said;
      if (fresh) {
        this.#frames.push(said);
        if (this.#frames.length > DEEP) this.#frames.shift();
        this.pictures += 1;
      }
      if (said.n % 10 === 0) this.ask({ do: "beat", read: said.n });
      this.#tell(back ? "back" : "picture");
      if (back) this.#tell("picture");
    }
  }

  #broken(why, ever) {
    this.#why ||= why;  // the first reason says more than a failed reconnection
    if (ever) this.#why = why;
    this.dispatchEvent(new CustomEvent("lost", { detail: ever }));
  }

  #restart() { this.#frames = []; this.#shown = null; this.last = null; }

  #tell(kind) { this.dispatchEvent(new Event(kind)); }
}

function token() {
  let mine = sessionStorage.getItem(KEY);
  if (mine === null) {
    mine = Array.from(crypto.getRandomValues(new Uint8Array(12)), b => b.toString(16).padStart(2, "0")).join("");
    sessionStorage.setItem(KEY, mine);
  }
  return mine;
}

const between = (a, b, w) => a.map((value, k) => value + w * (b[k] - value));

function mix(a, b, w, t) {
  const keyed = (one, two) => Object.fromEntries(Object.keys(two).map(k =>
    [k, two[k] === null ? null : (one[k] ?? two[k]) + w * (two[k] - (one[k] ?? two[k]))]));
  const others = Object.fromEntries(Object.entries(b.others).map(([name, s]) => [name, between(a.others[name] ?? s, s, w)]));
  return { t, own: between(a.own, b.own, w), act: keyed(a.act, b.act), ord: b.ord, around: between(a.around, b.around, w),
    others, ghost: a.ghost && b.ghost ? between(a.ghost, b.ghost, w) : b.ghost ?? null };
}
