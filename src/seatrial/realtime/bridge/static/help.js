// The list of keys: what the page obeys is what it shows.

import { make } from "./shared/dom.js";

export class Help {
  constructor(dialog, keys) {
    this.dialog = dialog;
    this.body = make("tbody");
    dialog.replaceChildren(make("h2", {}, "Keys"), make("table", {}, this.body),
      make("form", { method: "dialog" }, make("button", {}, "Close")));
    this.keys = keys;
  }

  /** Rows of a ship: those of its rudder and engine before those of the page. */
  begin(hints) {
    const rows = this.keys.map(({ keys, text }) => [keys.flatMap((key, k) => [...(k ? [" "] : []), make("kbd", {}, key)]), text]);
    this.body.replaceChildren(...hints.map(hint => make("tr", {}, make("td", { colspan: 2 }, ...hint))),
      ...rows.map(([keys, text]) => make("tr", {}, make("td", {}, ...keys), make("td", {}, text))));
  }

  toggle() { if (this.dialog.open) this.dialog.close(); else this.dialog.showModal(); }
}
