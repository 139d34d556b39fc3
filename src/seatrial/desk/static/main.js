// The page: what is in the folder, what is chosen, and the commands that were run.  All state is on the disk.

import { make } from "./shared/dom.js";
import { palettes } from "./shared/palettes.js";
import { form } from "./forms.js";
import { watch } from "./jobs.js";
import * as server from "./server.js";
import { view } from "./trial.js";

const element = id => document.getElementById(id);
const KINDS = {
  logs: "Logs", log: "Logs", mapping: "Mappings", trials: "Trials", steps: "Steps", particulars: "Particulars",
  ship: "Ships", study: "Studies", run: "Fits", page: "Pages", fmu: "FMUs", scenario: "Scenarios", case: "Cases", campaign: "Campaigns",
};
const TEXTS = ["mapping", "steps", "particulars", "ship", "study", "scenario", "case", "campaign"];
const state = { items: [], ships: [], actions: [] };

function tell(words) {
  element("notice").textContent = words;
  element("notice").hidden = !words;
}

const guarded = act => (...given) => Promise.resolve(act(...given)).catch(error => tell(error.message));

const refresh = guarded(async () => {
  const found = await server.look("api/shelf");
  Object.assign(state, found);
  document.title = `${found.folder} – seatrial`;
  element("title").textContent = found.folder;
  const groups = Map.groupBy ? Map.groupBy(found.items, one => KINDS[one.kind]) : grouped(found.items);
  element("items").replaceChildren(...[...groups].map(([title, items]) => make("div", {}, make("h2", {}, title), make("ul", {}, ...items.map(entry)))));
  element("next").replaceChildren(...next());
  document.querySelectorAll("#view form").forEach(one => one.renew());
  watch(element("jobs"), found.jobs, refresh);
});

/** A command has begun: on a narrow screen it lies below the form. */
async function begun() {
  await refresh();
  element("jobs").firstElementChild?.scrollIntoView({ block: "nearest" });
}

function grouped(items) {
  const groups = new Map();
  for (const one of items) groups.set(KINDS[one.kind], [...(groups.get(KINDS[one.kind]) ?? []), one]);
  return groups;
}

function entry(one) {
  const count = { logs: "files", trials: "trials", run: "files" }[one.kind];
  const size = count ? `${one.size} ${count}` : one.size < 1e4 ? `${one.size} bytes` : one.size < 1e6 ? `${Math.round(one.size / 1e3)} kB` : `${(one.size / 1e6).toFixed(1)} MB`;
  const button = make("button", { type: "button" }, one.path, " ", make("small", {}, size));
  button.onclick = guarded(() => open(one));
  return make("li", {}, button);
}

/** What to do next, by what is there: the first that is missing on the way from logs to a model. */
function next() {
  const first = kind => state.items.find(one => one.kind === kind), go = (words, act) => {
    const button = make("button", { type: "button" }, words);
    button.onclick = guarded(act);
    return ["Next: ", button];
  };
  if (!state.items.length) return ["Drop the logs of the ship's trials on the left."];
  if (!first("trials")) return first("logs") || first("log") ? go("import the logs", () => open(first("logs") ?? first("log"))) : ["Drop logs on the left."];
  if (!first("ship")) return go("a ship for these trials", ships);
  if (!first("study")) return go("write a study", () => open(first("ship")));
  if (!first("run")) return go("fit", () => open(first("study")));
  return go("read the report of the fit", () => open(first("run")));
}

async function open(one, given = {}) {
  tell("");
  const parts = [make("h1", { tabindex: "-1" }, one.path)];
  if (one.kind === "run") parts.push(...await results(one));
  if (one.kind === "page") parts.push(link(one.path, "Open this page"));
  if (one.kind === "fmu") parts.push(link(one.path, "Download"));
  parts.push(...offered(one.kind, one, given));
  if (one.kind === "trials") parts.push(trials(one));
  if (TEXTS.includes(one.kind)) parts.push(await editor(one));
  show(parts);
}

function show(parts) {
  element("view").replaceChildren(...parts);
  parts[0].focus({ preventScroll: true });
  parts[0].scrollIntoView({ block: "start" });
}

function ships() {
  const here = state.items.find(one => one.kind === "trials");
  show([make("h1", { tabindex: "-1" }, "A ship for these trials"),
    make("p", { class: "aside" }, "A fit starts from a ship: one of the library that is like yours, or an estimate from its particulars."),
    ...offered("", here ?? {}, {})]);
}

/** The forms of all actions for a kind of item, the first of them open. */
function offered(kind, one, given) {
  const mine = state.actions.filter(action => action.about.includes(kind));
  if (one.format) mine.sort((a, b) => (b.key === "import") - (a.key === "import")); // logs that tell what they are need no guess
  return [make("div", { class: "actions" }, ...mine.map((action, k) => {
    const usual = { ...Object.fromEntries(action.fields.filter(field => fits(field, one)).map(field => [field.name, one.kind === "run" ? `${one.path}/model.toml` : one.path])), ...given };
    return make("details", { open: given.action ? given.action === action.key : k === 0 && kind !== "trials" }, make("summary", {}, action.title), form(action, usual, state, begun));
  }))];
}

const fits = (field, one) => field.kinds.includes(one.kind) || (field.kind === "ship" && ["ship", "run"].includes(one.kind));

async function results(one) {
  const inside = state.items.filter(other => other.path.startsWith(`${one.path}/`));
  return [make("div", { class: "row" }, ...inside.map(other => link(other.path, `${other.kind === "page" ? "Open" : "Download"} ${other.path.split("/").at(-1)}`)))];
}

const link = (path, words) => make("a", { href: server.file(path), target: "_blank", rel: "noopener" }, words);

function trials(one) {
  const menu = make("select", { "aria-label": "Trial" }, ...one.names.map(name => new Option(name, name))), place = make("div");
  menu.onchange = guarded(async () => {
    const path = `${one.path}/${menu.value}.csv`, found = await server.look("api/trial", path);
    place.replaceChildren(view(found, guarded(stretches => write(one, menu.value, stretches))));
  });
  menu.onchange();
  return make("div", {}, make("h2", {}, "Map and traces"), menu, place);
}

async function write(one, trial, stretches) {
  const taken = new Set(state.items.map(other => other.path));
  let out = "cuts.toml";
  for (let k = 2; taken.has(out); k++) out = `cuts-${k}.toml`;
  await server.send("POST", "api/cut", { trial, stretches, out });
  await refresh();
  await open(one, { action: "mend", steps: out });
}

async function editor(one) {
  let was = (await server.look("api/text", one.path)).text;
  const area = make("textarea", { "aria-label": `Text of ${one.path}`, spellcheck: "false" }), save = make("button", { type: "button", disabled: true }, "Save");
  area.value = was;
  area.oninput = () => { save.disabled = area.value === was; };
  save.onclick = guarded(async () => {
    await server.text(one.path, was, area.value);
    was = area.value;
    save.disabled = true;
    tell("");
  });
  return make("div", {}, make("h2", {}, "The file"), area, make("div", { class: "row" }, save));
}

const dropped = guarded(async files => {
  for (const one of files) await server.upload(one, share => tell(`${one.name}: ${(100 * share).toFixed(0)} %`));
  tell("");
  await refresh();
});

const drop = element("drop"), chosen = element("chosen");
chosen.onchange = () => dropped([...chosen.files]).then(() => { chosen.value = ""; });
addEventListener("dragover", event => { event.preventDefault(); drop.classList.add("over"); });
addEventListener("dragleave", () => drop.classList.remove("over"));
addEventListener("drop", event => { event.preventDefault(); drop.classList.remove("over"); dropped([...event.dataTransfer.files]); });
element("refresh").onclick = refresh;
element("ship-new").onclick = ships;
palettes(element("palette"));
guarded(async () => {
  Object.assign(state, await server.look("api/catalogue"));
  await refresh();
})();
