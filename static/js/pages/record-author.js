// Whose order is recorded: a name, remembered in this browser. Left empty it is the project's own expert's, as with one expert.

import { fill, h } from "../dom.js";

const KEPT = "apprentice-author";

function remembered() {
  try {
    return localStorage.getItem(KEPT) ?? "";
  } catch {
    return ""; // no storage in this browser: the name is asked for again
  }
}

export class Author {
  constructor({ onChange }) {
    this.names = h("datalist#authors");
    this.field = h("input.field", { id: "author", value: remembered(), maxlength: "120", placeholder: "no name needed", list: "authors", autocomplete: "off", oninput: () => this.keep(), onchange: onChange });
    this.node = h("div.author", {}, h("label", { for: "author", dataset: { tip: "Orders of several experts are kept apart by their names.\nWith one expert no name is needed." } }, "Your name"), this.field, this.names);
  }

  get name() {
    return this.field.value.trim().replace(/\s+/g, " ");
  }

  keep() {
    try {
      localStorage.setItem(KEPT, this.name);
    } catch {
      // only the presetting next time is lost
    }
  }

  offer(names) {
    fill(this.names, [...new Set(names)].map((name) => h("option", { value: name })));
  }

  // The orders of a tool by this expert, and by others.
  split(tool) {
    const own = (entry) => (this.name ? !entry.own && entry.name.toLowerCase() === this.name.toLowerCase() : entry.own);
    const orders = tool.demonstrated_by ?? [];
    return { mine: orders.find(own), others: orders.filter((entry) => !own(entry)).map((entry) => entry.name) };
  }
}

// What the head of the page says about the orders a tool has already.
export function standingWords({ mine, others }) {
  if (mine) return "Already demonstrated. What you save now takes the place of the older order.";
  if (!others.length) return "Click the regions in your order. Nothing is final until you save.";
  const who = others.length > 1 ? `${others.slice(0, -1).join(", ")} and ${others.at(-1)} have` : `${others[0]} has`;
  return `${who} shown this tool. Your order is kept beside ${others.length > 1 ? "theirs" : "it"}.`;
}
