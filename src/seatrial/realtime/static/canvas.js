// Drawing: a canvas at the resolution of the screen, round numbers, day and night colours.

let palette = null, moved = () => {};

/** Present colours of the style sheet by name. */
export function colours(names) {
  return palette ??= Object.fromEntries(names.map(name =>
    [name, getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim()]));
}

/** Context of a canvas at the resolution of the screen; units are those of the page. */
export function fitted(canvas) {
  const ratio = Math.min(devicePixelRatio || 1, 2), width = canvas.clientWidth, height = canvas.clientHeight;
  if (canvas.width !== Math.round(width * ratio) || canvas.height !== Math.round(height * ratio)) {
    canvas.width = Math.round(width * ratio); canvas.height = Math.round(height * ratio);
  }
  const g = canvas.getContext("2d");
  g.setTransform(ratio, 0, 0, ratio, 0, 0);
  return { g, width, height };
}

/** The next round number: 1, 2 or 5 of its decade. */
export function nice(wanted) {
  const decade = 10 ** Math.floor(Math.log10(wanted));
  return [1, 2, 5, 10].map(m => m * decade).find(step => step >= wanted);
}

/** Day or night colours by a button; initially as the last time, else as the system prefers. */
export function nightly(button, each = () => {}) {
  moved = each;
  const kept = localStorage.getItem("seatrial-night");
  night(button, kept === null ? matchMedia("(prefers-color-scheme: dark)").matches : kept === "true");
  const turn = () => {
    night(button, document.documentElement.dataset.theme !== "night");
    localStorage.setItem("seatrial-night", String(document.documentElement.dataset.theme === "night"));
  };
  button.onclick = turn;
  return turn;
}

function night(button, on) {
  document.documentElement.dataset.theme = on ? "night" : "day";
  button.setAttribute("aria-pressed", String(on));
  palette = null;
  moved();
}
