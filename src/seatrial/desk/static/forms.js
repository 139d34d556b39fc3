// An action as a form: its fields, the command that it runs, and the button.

import { make } from "./shared/dom.js";
import { command } from "./server.js";

/** The form of an action.  `given` has what stands in its fields at first; `state` has items and ships of the folder;
 *  `ran` hears the number of the command. */
export function form(action, given, state, ran) {
  const inputs = {}, shown = make("code", { class: "command" }), go = make("button", { class: "go" }, "Run");
  const rows = action.fields.map(field => {
    inputs[field.name] = input(field, given[field.name] ?? "", state);
    return make("label", { class: "ask" }, make("span", {}, field.label + (field.needed ? "" : " (optional)")), inputs[field.name]);
  });
  const values = () => Object.fromEntries(Object.entries(inputs).map(([name, one]) => [name, one.value]));
  let waiting = 0;
  const preview = () => {
    const mine = ++waiting;
    command(action.key, values(), false).then(
      said => mine === waiting && (said.lacks ? show(said.lacks, true) : show(["seatrial", ...said.arguments].map(quoted).join(" "), false)),
      error => mine === waiting && show(error.message, true));
  };
  const show = (words, wrong) => {
    shown.textContent = words;
    shown.classList.toggle("wrong", wrong);
    go.disabled = wrong;
  };
  const whole = make("form", {}, ...rows, shown, go);
  whole.oninput = preview;
  whole.renew = () => {
    action.fields.forEach(field => renewed(field, inputs[field.name], state));
    preview();
  };
  whole.onsubmit = async event => {
    event.preventDefault();
    go.disabled = true;
    try { ran((await command(action.key, values(), true)).number); go.disabled = false; } catch (error) { show(error.message, true); }
  };
  preview();
  return whole;
}

const offered = (field, state) => state.items.filter(one => field.kinds.includes(one.kind)).map(one => one.path);

/** A field after the folder has changed: what has come can be chosen, and is where nothing was; a name that is taken by
 *  now gives way to a free one, unless a person wrote it. */
function renewed(field, one, state) {
  if (field.kind === "item") {
    const known = [...one.options].map(option => option.value), fresh = offered(field, state).filter(name => !known.includes(name));
    const open = !one.value;
    one.append(...fresh.map(name => new Option(name, name)));
    if (open && fresh.length) one.value = fresh[0];
  } else if (one.value && one.value === one.dataset.usual) one.value = one.dataset.usual = free(field.usual, state);
}

function input(field, given, state) {
  if (field.kind === "item") return choice(field.needed ? offered(field, state) : ["", ...offered(field, state)], given);
  if (field.kind === "choice") return choice(field.kinds, given);
  if (field.kind === "ship") {
    const files = state.items.filter(one => one.kind === "ship").map(one => one.path);
    return choice([...files, ...state.ships], given || files[0]);
  }
  if (field.kind === "number") return make("input", { value: given, inputmode: "decimal", autocomplete: "off" });
  const usual = field.usual ? free(field.usual, state) : "";
  const one = make("input", { value: given || usual, autocomplete: "off", spellcheck: "false" });
  one.dataset.usual = usual;
  return one;
}

function choice(names, given) {
  const menu = make("select", {}, ...names.map(name => new Option(name || "–", name)));
  if (names.includes(given)) menu.value = given;
  return menu;
}

/** A name that is not taken: run, run-2, run-3. */
function free(name, state) {
  const taken = new Set(state.items.map(one => one.path)), [, stem, end] = name.match(/^(.*?)(\.[a-z]+)?$/);
  for (let k = 1; ; k++) {
    const one = (k === 1 ? stem : `${stem}-${k}`) + (end ?? "");
    if (!taken.has(one)) return one;
  }
}

const quoted = word => /^[\w@%+=:,./-]+$/.test(word) ? word : `'${word.replaceAll("'", `'"'"'`)}'`;
