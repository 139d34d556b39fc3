// A trial: its track, its traces over time, and stretches of time to cut out, chosen by mouse, touch or numbers.

import { drawn, make } from "./shared/dom.js";

const FIRST = ["u", "v_m", "r", "psi", "delta", "n_P"], WIDTH = 640, TALL = 96, LEFT = 78, RIGHT = 10;
const EDGE = 30, SIDE = 420;

/** The view of a trial; `write` takes its stretches and gives a promise. */
export function view(trial, write) {
  const stretches = [], chosen = { from: NaN, to: NaN };
  const plotted = trial.channels.filter(one => !["x", "y"].includes(one.name) && one.values.some(value => value !== null));
  const shown = new Set(plotted.filter(one => FIRST.includes(one.name)).map(one => one.name));
  if (!shown.size) plotted.slice(0, 4).forEach(one => shown.add(one.name));
  const track = make("div"), traces = make("div"), list = make("div"), from = number("from [s]"), to = number("to [s]");
  const [t0, t1] = [trial.t[0], trial.t.at(-1)];
  const draw = () => {
    track.replaceChildren(plan(trial, chosen));
    traces.replaceChildren(strips(trial, plotted.filter(one => shown.has(one.name)), chosen, stretches, set));
    list.replaceChildren(...stretches.map((one, k) => make("div", { class: "row" },
      make("span", {}, `cut out ${one[0].toFixed(1)} to ${one[1].toFixed(1)} s`), button("Take back", () => { stretches.splice(k, 1); draw(); }))));
    done.disabled = !stretches.length;
    for (const one of [out, keep]) one.disabled = !(chosen.from < chosen.to);
  };
  const set = (a, b) => {
    [chosen.from, chosen.to] = [Math.max(t0, Math.min(a, b)), Math.min(t1, Math.max(a, b))];
    [from.value, to.value] = [chosen.from.toFixed(1), chosen.to.toFixed(1)];
    draw();
  };
  const typed = () => {
    [chosen.from, chosen.to] = [Number(from.value || NaN), Number(to.value || NaN)];
    draw();
  };
  from.oninput = to.oninput = typed;
  const out = button("Cut this out", () => { stretches.push([chosen.from, chosen.to]); clear(); });
  const keep = button("Keep only this", () => {
    const rest = [[t0, chosen.from], [chosen.to, t1]].filter(([a, b]) => b > a);
    stretches.splice(0, stretches.length, ...rest);
    clear();
  });
  const clear = () => { chosen.from = chosen.to = NaN; from.value = to.value = ""; draw(); };
  const done = button("Write these as steps, and mend", () => write(stretches));
  const menu = make("fieldset", {}, make("legend", {}, "Traces"), ...plotted.map(one => {
    const box = make("input", { type: "checkbox", checked: shown.has(one.name) });
    box.onchange = () => { box.checked ? shown.add(one.name) : shown.delete(one.name); draw(); };
    return make("label", {}, box, one.name);
  }));
  draw();
  return make("div", {},
    make("p", { class: "aside" }, `${trial.rows} rows, ${(t1 - t0).toFixed(0)} s. Drag over a trace, or write two times, to choose a stretch.`),
    make("div", { class: "row" }, from, to, out, keep), list, make("div", { class: "row" }, done),
    make("div", { class: "plots" }, track, traces), menu);
}

const number = label => make("input", { inputmode: "decimal", placeholder: label, "aria-label": label, autocomplete: "off" });

function button(words, act) {
  const one = make("button", { type: "button" }, words);
  one.onclick = act;
  return one;
}

/** The track, north up, both axes to one scale. */
function plan(trial, chosen) {
  const values = name => trial.channels.find(one => one.name === name)?.values ?? [];
  const [x, y] = [values("x"), values("y")], there = x.map((_, k) => k).filter(k => x[k] !== null && y[k] !== null);
  const box = drawn("svg", { viewBox: `0 0 ${SIDE} ${SIDE}`, role: "img", "aria-label": "Track, north up" });
  if (!there.length) return filled(box, label(SIDE / 2, SIDE / 2, "no position is recorded", "middle"));
  const ends = list => [Math.min(...list), Math.max(...list)];
  const [south, north] = ends(there.map(k => x[k])), [west, east] = ends(there.map(k => y[k]));
  const span = Math.max(north - south, east - west, 1e-9), scale = (SIDE - 2 * EDGE) / span;
  const at = k => `${(SIDE / 2 + (y[k] - (west + east) / 2) * scale).toFixed(1)},${(SIDE / 2 - (x[k] - (south + north) / 2) * scale).toFixed(1)}`;
  const part = there.filter(k => trial.t[k] >= chosen.from && trial.t[k] <= chosen.to);
  const bar = nice(span / 3), [sx, sy] = at(there[0]).split(",");
  return filled(box,
    drawn("polyline", { class: "trace", points: there.map(at).join(" ") }),
    drawn("polyline", { class: "chosen", points: part.map(at).join(" ") }),
    drawn("circle", { class: "start", cx: sx, cy: sy, r: 5 }), label(Number(sx) + 8, sy, "start"),
    drawn("path", { class: "axis", d: `M${EDGE},${SIDE - 12}h${bar * scale}` }), label(EDGE, SIDE - 17, `${bar} m`),
    label(SIDE - 12, 22, "N ↑", "end"));
}

/** Traces one below the other over one time axis; dragging chooses a stretch. */
function strips(trial, channels, chosen, stretches, set) {
  const tall = TALL * channels.length + 26, wide = WIDTH - LEFT - RIGHT, [t0, t1] = [trial.t[0], trial.t.at(-1)];
  const box = drawn("svg", { viewBox: `0 0 ${WIDTH} ${tall}`, role: "img", "aria-label": "Traces over time" });
  const across = t => LEFT + wide * (t - t0) / Math.max(t1 - t0, 1e-9);
  const band = (a, b, kind) => a < b ? [drawn("rect", { class: kind, x: across(a), y: 0, width: across(b) - across(a), height: tall - 22 })] : [];
  const parts = [...stretches.flatMap(([a, b]) => band(a, b, "gone")), ...band(chosen.from, chosen.to, "span")];
  channels.forEach((one, k) => {
    const known = one.values.filter(value => value !== null), low = Math.min(...known), high = Math.max(...known);
    const up = value => TALL * (k + 1) - 8 - (TALL - 20) * (value - low) / Math.max(high - low, 1e-12);
    let pen = "M";
    const d = one.values.map((value, i) => {
      if (value === null) { pen = "M"; return ""; }
      const said = `${pen}${across(trial.t[i]).toFixed(1)},${up(value).toFixed(1)}`;
      pen = "L";
      return said;
    }).join("");
    parts.push(drawn("path", { class: "axis", d: `M${LEFT},${TALL * (k + 1)}H${WIDTH - RIGHT}` }), drawn("path", { class: "trace", d }),
      label(4, TALL * k + 46, one.name, "start", "name"), label(4, TALL * k + 63, one.unit),
      label(LEFT - 4, TALL * k + 18, figure(high, high - low), "end"), label(LEFT - 4, TALL * (k + 1) - 4, figure(low, high - low), "end"));
  });
  const step = nice((t1 - t0) / 6);
  for (let t = Math.ceil(t0 / step) * step; t <= t1; t += step)
    parts.push(drawn("path", { class: "axis", d: `M${across(t)},0V${tall - 20}` }), label(across(t), tall - 6, `${+t.toFixed(6)} s`, "middle"));
  filled(box, ...parts);
  const time = event => {
    const where = box.getBoundingClientRect();
    return t0 + (t1 - t0) * ((event.clientX - where.left) / where.width * WIDTH - LEFT) / wide;
  };
  box.onpointerdown = event => {
    const began = time(event), whole = box.parentElement;
    // The drawing is made anew while the pointer moves: the document hears it.
    const moved = now => set(began, timeIn(whole.firstElementChild, now, t0, t1, wide));
    const ended = () => { removeEventListener("pointermove", moved); removeEventListener("pointerup", ended); };
    addEventListener("pointermove", moved);
    addEventListener("pointerup", ended);
    event.preventDefault();
  };
  return box;
}

function timeIn(box, event, t0, t1, wide) {
  const where = box.getBoundingClientRect();
  return t0 + (t1 - t0) * ((event.clientX - where.left) / where.width * WIDTH - LEFT) / wide;
}

const filled = (element, ...children) => { element.append(...children); return element; };
const label = (x, y, words, anchor = "start", kind = "") => drawn("text", { x, y, "text-anchor": anchor, class: kind }, words);
const figure = (value, span) => value.toFixed(Math.max(0, Math.min(4, 2 - Math.floor(Math.log10(Math.max(span, 1e-4))))));

/** 1, 2 or 5 times a power of ten. */
function nice(value) {
  const power = 10 ** Math.floor(Math.log10(Math.max(value, 1e-9)));
  return [1, 2, 5, 10].map(k => k * power).find(k => k >= value) ?? 10 * power;
}
