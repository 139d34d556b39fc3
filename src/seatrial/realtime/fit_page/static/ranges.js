// Free parameters, each on a rail from the low to the high end of its range.

export class Ranges {
  constructor(section) { this.section = section; this.rows = []; this.free = []; }

  begin(part) {
    this.free = part.free;
    this.section.hidden = !part.free.length;
    this.section.querySelector("#count").textContent = `${part.free.length} free parameters, ${part.trials} training trials`
      + (part.validation ? `, ${part.validation} for validation` : "");
    this.rows = part.free.map(row);
    this.section.querySelector("#rows").replaceChildren(...this.rows.map(one => one.root));
  }

  show(values) {
    values.forEach((value, k) => { if (value !== null && this.rows[k]) place(this.rows[k], this.free[k], value); });
  }
}

function row(f) {
  const root = make("div", "parameter"), name = make("span", "name"), number = make("span", "number"), rail = make("div", "rail");
  name.textContent = f.path; root.title = `${f.path}: ${f.about || "free parameter"}${unit(f) ? ` [${unit(f)}]` : ""}; from ${text(f.from)} to ${text(f.to)}`
    + (f.sigma === null ? "" : `; prior ${text(f.prior)} ± ${text(f.sigma)}`);
  const one = { root, number, rail, from: f.from, to: f.to, value: make("b", "value") };
  one.prior = f.sigma !== null && f.prior !== null ? rail.appendChild(make("b", "prior")) : null;
  one.bounds = [f.low, f.high].map(end => end !== null && end >= f.from && end <= f.to ? rail.appendChild(make("b", "bound")) : null);
  one.begun = rail.appendChild(make("b", "begun"));
  one.value.hidden = true;
  rail.append(one.value); root.append(name, number, rail);
  lay(one, f);
  number.textContent = "–";
  return one;
}

function lay(one, f) {
  const at = value => `${Math.min(Math.max(100 * (value - one.from) / (one.to - one.from), 0), 100)}%`;
  if (one.prior) { one.prior.style.left = at(f.prior - f.sigma); one.prior.style.right = `calc(100% - ${at(f.prior + f.sigma)})`; }
  one.bounds.forEach((mark, k) => { if (mark) mark.style.left = at(k ? f.high : f.low); });
  one.begun.style.left = at(f.start);
  return at;
}

function place(one, f, value) {
  const room = 0.05 * (f.to - f.from);
  if (value < one.from) one.from = Math.min(value - room, one.from);
  if (value > one.to) one.to = Math.max(value + room, one.to);
  const at = lay(one, f);
  one.value.hidden = false;
  one.value.style.left = at(value);
  one.number.textContent = text(value);
  if (unit(f)) one.number.append(" ", Object.assign(make("i", ""), { textContent: unit(f) }));
  const near = 1e-6 * (one.to - one.from);
  one.root.classList.toggle("stuck", (f.low !== null && value - f.low <= near) || (f.high !== null && f.high - value <= near));
}

/** Unit of a parameter; a prime means none, as in the ship file. */
const unit = f => f.unit === "'" ? "" : f.unit.replace("^2", "²").replace("^3", "³");

const make = (kind, name) => Object.assign(document.createElement(kind), { className: name });

const text = value => value === null ? "–" : Number(value.toPrecision(4)).toString().replace("-", "−");
