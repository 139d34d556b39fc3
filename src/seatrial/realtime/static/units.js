// Conversion to the units of the page: degrees, knots, revolutions per minute.  All other data are SI and radians.

export const DEGREE = Math.PI / 180;
export const MILE = 1852;
export const KNOT = MILE / 3600;

const SHOWN = { "rad": ["°", 1 / DEGREE], "1/s": ["rpm", 60] };

/** Unit on the page for an SI unit, and the factor to it. */
export const shown = unit => SHOWN[unit] ?? [unit, 1];

/** A course or heading with three digits and a tenth. */
export function course(psi) {
  const degrees = (((psi / DEGREE) % 360) + 360) % 360;
  return (degrees >= 359.95 ? 0 : degrees).toFixed(1).padStart(5, "0");
}

/** A number with a true minus and no "-0". */
export function fixed(value, digits = 1) {
  const text = Math.abs(value).toFixed(digits);
  return value < 0 && Number(text) !== 0 ? `−${text}` : text;
}

/** An angle or rate with its side as a letter, since colour alone is not enough: P for port, S for starboard. */
export function sided(value, digits = 1, unit = "") {
  const text = Math.abs(value).toFixed(digits);
  return Number(text) === 0 ? `${text}${unit}` : `${text}${unit} ${value < 0 ? "P" : "S"}`;
}

/** A distance in nautical miles, in metres where it is below a fiftieth of one. */
export function miles(metres) {
  const nm = metres / MILE;
  return nm < 0.02 ? `${Number(metres.toPrecision(2))} m` : `${Number(nm.toPrecision(3))} NM`;
}

/** Seconds as h:mm:ss. */
export function clock(t) {
  const s = Math.floor(t + 1e-6), two = n => String(n).padStart(2, "0");
  return `${s >= 3600 ? `${Math.floor(s / 3600)}:` : ""}${two(Math.floor(s / 60) % 60)}:${two(s % 60)}`;
}

/** An index of a manoeuvre as text. */
export function figure([name, value, unit, lengths]) {
  if (value === null) return [name.replaceAll("_", " "), "–", ""];
  const [to, factor] = unit === "rad/s" ? ["°/s", 1 / DEGREE] : unit === "m/s" ? ["kn", 1 / KNOT] : shown(unit);
  const number = Number((value * factor).toPrecision(4));
  return [name.replaceAll("_", " "), `${fixed(number, Math.abs(number) < 10 ? 2 : 1)} ${to === "-" ? "" : to}`,
    lengths === null ? "" : `${lengths.toFixed(2)} L`];
}

/** Latitude or longitude as degrees and minutes with its side. */
export function angle(value, plus, minus, digits) {
  const size = Math.round(Math.abs(value) * 60000) / 1000, whole = Math.floor(size / 60);
  return `${String(whole).padStart(digits, "0")}°${(size - 60 * whole).toFixed(3).padStart(6, "0")}′${value < 0 ? minus : plus}`;
}

/** Time of day of seconds since 1970. */
export const utc = seconds => new Date(1000 * seconds).toISOString().slice(11, 19);
