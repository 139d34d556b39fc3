// Drawing: a canvas at the resolution of the screen, round numbers, the colours and the size of text of the page.

let palette = null, wide = 0, grown = 1;

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

/** Take the colours from the style sheet again, after a change of palette. */
export function repaint() { palette = null; }

/** Font of a size [pixels at the usual size of text], which grows with the text of the page. */
export function font(size, weight = "") {
  return `${weight} ${size * scale()}px system-ui, sans-serif`;
}

/** Size of the text of the page relative to the usual one, for lengths in a drawing. */
export function scale() {
  if (innerWidth !== wide) { wide = innerWidth; grown = parseFloat(getComputedStyle(document.documentElement).fontSize) / 16; }
  return grown;
}
