// Wishes about the order of a tool: what comes before what, first, last, never next, left out, done already.
// Picked from lists or by clicking two regions in the 3D view; each wish is a chip that can be taken away.

import { fill, h } from "./dom.js";
import { icon } from "./icons.js";
import { plural } from "./words.js";

const KINDS = {
  before: { two: true, label: "before", say: (a, b) => `${a} before ${b}` },
  never_next: { two: true, label: "never directly followed by", say: (a, b) => `${b} never directly after ${a}` },
  first: { two: false, label: "first", say: (a) => `${a} first` },
  last: { two: false, label: "last", say: (a) => `${a} last` },
  skip: { two: false, label: "left out", say: (a) => `${a} left out` },
  done: { two: false, label: "done already", say: (a) => `${a} done already` },
};

const none = () => ({ before: [], never_next: [], first: null, last: null, skip: [], done: [] });

/** The chips of a set of wishes: [kind, regions, position in its list]. */
export function wishesIn(wishes) {
  return Object.keys(KINDS).flatMap((kind) => {
    if (kind === "first" || kind === "last") return wishes[kind] === null ? [] : [[kind, [wishes[kind]], 0]];
    return wishes[kind].map((entry, at) => [kind, KINDS[kind].two ? entry.flat() : [entry], at]);
  });
}

/** A copy with one wish more; a second first or last replaces the one before. */
export function withWish(wishes, kind, a, b) {
  if (kind === "first" || kind === "last") return { ...wishes, [kind]: a };
  if (kind === "before") return { ...wishes, before: [...wishes.before, [[a], [b]]] };
  return { ...wishes, [kind]: [...wishes[kind], KINDS[kind].two ? [a, b] : a] };
}

/** A copy with one wish less. */
export function withoutWish(wishes, kind, at) {
  if (kind === "first" || kind === "last") return { ...wishes, [kind]: null };
  return { ...wishes, [kind]: wishes[kind].filter((_, i) => i !== at) };
}

export class Wishes {
  /** `onChange(wishes)` makes the plan again and throws when the server refuses; the wish is then taken back and its sentence shown. */
  constructor({ onChange }) {
    this.onChange = onChange;
    this.names = [];
    this.wishes = none();
    this.fault = "";
    this.busy = false;
    this.picked = null;
    this.kind = h("select", { "aria-label": "What you want", onchange: () => this.paint() }, Object.entries(KINDS).map(([kind, { label }]) => h("option", { value: kind }, label)));
    this.from = h("select", { "aria-label": "Region" });
    this.to = h("select", { "aria-label": "Other region" });
    this.button = h("button.btn.small", { type: "button", onclick: () => this.add() }, "Add");
    this.count = h("span.muted");
    this.body = h("div");
    this.node = h("details.wishes", { "aria-label": "Wishes about the order" }, h("summary", { dataset: { key: "wishes" } }, icon("right", "caret"), h("b", {}, "The order must keep"), this.count), this.body);
  }

  /** Another tool: its region names by number, and what its plan respects. */
  reset(names, wishes) {
    this.names = names;
    this.wishes = { ...none(), ...wishes };
    this.fault = "";
    this.picked = null;
    const options = () => names.map((name, region) => h("option", { value: region }, name));
    fill(this.from, options());
    fill(this.to, options());
    if (names.length > 1) this.to.value = "1";
    this.paint();
  }

  get asked() {
    return wishesIn(this.wishes).length ? this.wishes : null;
  }

  /** A region clicked in 3D: the first fills the first list, the second the other. */
  pick(region) {
    if (region === null || region === undefined || !this.names[region]) return;
    const second = KINDS[this.kind.value].two && this.picked !== null && this.picked !== region;
    (second ? this.to : this.from).value = String(region);
    this.picked = second ? null : region;
    this.paint();
  }

  add() {
    const kind = this.kind.value;
    const [a, b] = [Number(this.from.value), Number(this.to.value)];
    return this.change(withWish(this.wishes, kind, a, b));
  }

  async change(wishes) {
    if (this.busy) return;
    const kept = this.wishes;
    Object.assign(this, { wishes, fault: "", busy: true, picked: null });
    this.paint();
    try {
      await this.onChange(this.asked);
    } catch (error) {
      this.wishes = kept;
      this.fault = error.message;
    }
    this.busy = false;
    this.paint();
  }

  paint() {
    const two = KINDS[this.kind.value].two;
    this.button.disabled = this.busy;
    const chips = wishesIn(this.wishes).map(([kind, regions, at]) => {
      const words = KINDS[kind].say(...regions.map((region) => this.names[region]));
      return h("button.chip", { type: "button", "aria-label": `Take away: ${words}`, disabled: this.busy, onclick: () => this.change(withoutWish(this.wishes, kind, at)) }, words, icon("cross"));
    });
    const hint = this.picked === null ? `Choose from the lists, or click ${two ? "two regions" : "a region"} on the tool.` : two ? `${this.names[this.picked]}, then? Click the other region.` : `${this.names[this.picked]} chosen.`;
    this.count.textContent = chips.length ? plural(chips.length, "wish", "wishes") : "nothing yet";
    fill(this.body, chips.length ? h("div.wish-chips", {}, chips) : null,
      h("div.wish-row", {}, this.from, this.kind, two ? this.to : null, this.button),
      h("p.small.muted", {}, hint), this.fault ? h("p.wish-fault", { role: "alert" }, this.fault) : null);
  }
}
