// Four palettes by the light around, chosen from a menu or by a key, and a dimmer for what no display dims by itself.

import { repaint } from "./canvas.js";

export const PALETTES = ["bright", "day", "dusk", "night"];
const LEAST = 0.3;  // of the light that the dimmer leaves

/** Let a menu choose the palette, initially as the last time, else as the system prefers; returns the function that
 *  takes the next one.  `each` is called after a change. */
export function palettes(menu, each = () => {}) {
  menu.replaceChildren(...PALETTES.map(name => new Option(name[0].toUpperCase() + name.slice(1), name)));
  const set = name => {
    document.documentElement.dataset.theme = menu.value = name;
    repaint();
    each();
  };
  const choose = name => { localStorage.setItem("seatrial-palette", name); set(name); };
  const kept = localStorage.getItem("seatrial-palette");
  set(PALETTES.includes(kept) ? kept : matchMedia("(prefers-color-scheme: dark)").matches ? "night" : "day");
  menu.onchange = () => { choose(menu.value); menu.blur(); };
  return () => choose(PALETTES[(PALETTES.indexOf(menu.value) + 1) % PALETTES.length]);
}

/** Let a slider from 0 (dimmest) to 1 dim the whole page; returns the function that moves it by a step. */
export function dimmer(slider) {
  const cover = document.createElement("div");
  cover.id = "dimmer";
  document.body.append(cover);
  const set = () => {
    cover.style.opacity = String((1 - LEAST) * (1 - Number(slider.value)));
    localStorage.setItem("seatrial-light", slider.value);
  };
  slider.value = localStorage.getItem("seatrial-light") ?? "1";
  slider.oninput = set;
  set();
  return by => { slider.value = String(Number(slider.value) + by); set(); };
}
