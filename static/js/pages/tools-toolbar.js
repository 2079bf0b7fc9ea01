// The toolbar above the 3D view, the hint on it, and the bar below that finishes what a mode has begun.

import { fill, h } from "../dom.js";
import { icon } from "../icons.js";
import { bind } from "../keys.js";
import { MODES, ORDER, regionNames, shownKey } from "./tools-modes.js";

const MOST_ROWS = 20;

export class Toolbar {
  constructor(editor) {
    this.editor = editor;
    this.buttons = new Map();
    this.node = h("div.edit-bar", { role: "toolbar", "aria-label": "Edit the regions", onkeydown: (event) => this.walk(event) }, this.tools(), this.gap(),
      this.colours = this.button("colours", "half", "Colours", () => editor.paint()),
      this.undo = this.button("undo", "undo", "Undo", () => editor.undo()), this.redo = this.button("redo", "redo", "Redo", () => editor.redo()));
    this.hint = h("p.edit-hint.plate", { role: "status" });
    this.finish = h("div.finish", { role: "group", "aria-label": "Finish the edit", hidden: true });
    this.drawn = "";
    this.bindKeys();
  }

  tools() {
    return ORDER.map((mode) => (mode ? this.button(mode, MODES[mode].icon, MODES[mode].short ?? MODES[mode].name, () => this.editor.enter(mode)) : this.gap()));
  }

  gap() {
    return h("span.gap", { role: "presentation" });
  }

  button(key, mark, words, run) {
    const node = h("button", { type: "button", dataset: { key: `mode-${key}`, mode: key }, "aria-label": MODES[key]?.name ?? words, onclick: (event) => {
      if (event.detail) node.blur(); // after a click of the mouse Enter finishes the edit instead of pressing the button again
      this.editor.inTurn(run);
    } }, icon(mark), h("span", {}, words));
    this.buttons.set(key, node);
    return node;
  }

  // Arrows move along the bar, as in every toolbar.
  walk(event) {
    const by = { ArrowLeft: -1, ArrowRight: 1 }[event.key];
    if (!by) return;
    const all = [...this.buttons.values()].filter((node) => !node.hidden);
    all[(all.indexOf(document.activeElement) + by + all.length) % all.length].focus();
    event.preventDefault();
  }

  bindKeys() {
    const { editor } = this;
    const when = () => Boolean(editor.tool?.edit) && editor.tool.state === "ready";
    const able = (test) => () => when() && (editor.running || test()); // what is under way may make it possible
    const inTurn = (run) => () => editor.inTurn(run);
    for (const mode of ORDER.filter(Boolean)) {
      const { letter, key, name } = MODES[mode];
      bind({ key: letter ?? key, shift: letter ? true : null, shown: shownKey(mode), name, when, run: inTurn(() => editor.enter(mode)) });
    }
    bind({ key: "Enter", name: "Finish the edit", when: able(() => Boolean(MODES[editor.mode].edit)), run: inTurn(() => editor.act()) });
    bind({ key: "Backspace", name: "Take the last point back", when: able(() => editor.points.length > 0), run: inTurn(() => editor.backspace()) });
    bind({ key: "Escape", name: "Leave the mode, then select nothing", when: able(() => editor.leavable), run: inTurn(() => editor.leave()) });
    bind({ key: "z", ctrl: true, shift: false, name: "Undo the last edit", when, run: inTurn(() => editor.undo()) });
    bind({ key: "z", ctrl: true, shift: true, shown: "Ctrl Shift Z", name: "Redo", when, run: inTurn(() => editor.redo()) });
    bind({ key: "k", shift: true, shown: "Shift K", name: "Colours of the CAD file, or of the regions", when: () => when() && editor.painted, run: inTurn(() => editor.paint()) });
    bind({ key: "a", ctrl: true, name: "Select all regions", when, run: inTurn(() => editor.select(editor.regions.filter((region) => !region.hidden).map((region) => region.id))) });
  }

  draw() {
    const { editor } = this;
    const { edit } = editor.tool;
    for (const [key, node] of this.buttons) {
      if (!MODES[key]) continue;
      const looks = ["select", "box"].includes(key);
      const off = !editor.possible && !looks;
      node.setAttribute("aria-disabled", String(off));
      node.setAttribute("aria-pressed", String(editor.mode === key));
      node.dataset.tip = [`${MODES[key].name} (${shownKey(key)})`, off ? editor.whyNot : MODES[key].tip].filter(Boolean).join("\n");
    }
    this.colours.hidden = !editor.painted;
    this.colours.setAttribute("aria-pressed", String(editor.colours === "cad"));
    this.colours.dataset.tip = "Show the colours of the CAD file (Shift K)";
    this.drawStep(this.undo, edit?.can_undo, `Undo${edit?.undo ? `: ${edit.undo}` : ""}`, "Ctrl Z", "Nothing to undo");
    this.drawStep(this.redo, edit?.can_redo, `Redo${edit?.redo ? `: ${edit.redo}` : ""}`, "Ctrl Shift Z", "Nothing to redo");
    const hint = editor.possible ? MODES[editor.mode].hint(editor) : editor.whyNot || MODES.select.hint();
    if (this.hint.textContent !== hint) this.hint.textContent = hint;
    this.drawFinish();
  }

  drawStep(node, possible, words, key, none) {
    node.setAttribute("aria-disabled", String(!possible));
    node.dataset.tip = possible ? `${words} (${key})` : none;
  }

  // Drawn anew only when it says something else, so that a field in it keeps its focus and its caret.
  drawFinish() {
    const { editor } = this;
    const { mode, busy, fault, selection, points, piece, rows, columns, cell, closed, to, level } = editor;
    const key = JSON.stringify([mode, busy, fault, selection, points.length, piece, rows, columns, cell, closed, to, level, editor.tool.segmentation_id]);
    if (key === this.drawn) return;
    this.drawn = key;
    const quiet = mode === "select" || mode === "box";
    this.finish.hidden = quiet && !busy && !fault;
    if (this.finish.hidden) return;
    fill(this.finish, fault ? h("p.fault", { role: "alert" }, icon("warn"), h("span", {}, fault)) : null, h("div.finish-row", {}, busy ? this.working(busy) : quiet ? this.dismiss() : this.confirm()));
  }

  working(words) {
    return [h("span.finish-busy", { "aria-hidden": "true" }), h("span", { role: "status" }, `${words} ...`)];
  }

  dismiss() {
    return h("button.btn.small", { type: "button", dataset: { key: "dismiss" }, onclick: () => this.editor.set({ fault: "" }) }, "Got it");
  }

  confirm() {
    const { editor } = this;
    const mode = MODES[editor.mode];
    const { missing } = editor;
    const cancel = h("button.btn.quiet.small", { type: "button", dataset: { key: "cancel" }, onclick: () => editor.inTurn(() => editor.enter("select")) }, editor.mode === "surface" ? "Done" : "Cancel", h("kbd", {}, "Esc"));
    const act = mode.edit && editor.mode !== "surface"
      ? h(`button.btn.small${missing ? "" : ".primary"}`, { type: "button", "aria-disabled": missing ? "true" : null, dataset: { key: "act", tip: missing }, onclick: () => editor.inTurn(() => editor.act()) }, missing ? mode.name : mode.words(editor), missing ? null : h("kbd", {}, "Enter"))
      : null;
    return [this.options(), act, cancel];
  }

  options() {
    const { editor } = this;
    if (editor.mode === "grid") return [this.count("rows", "rows"), h("span", { "aria-hidden": "true" }, "\u00d7"), this.count("columns", "columns"), this.cells()];
    if (editor.mode === "cut" && editor.points.length > 2) return h("label.check", {}, h("input", { type: "checkbox", checked: editor.closed, dataset: { key: "closed" }, onchange: (event) => editor.set({ closed: event.currentTarget.checked }) }), "Close the line");
    if (editor.mode === "reassign" && editor.piece) return this.destination();
    return null;
  }

  count(key, words) {
    const { editor } = this;
    const to = (value) => editor.set({ cell: 0, [key]: Math.max(1, Math.min(MOST_ROWS, Math.round(value) || 1)) });
    return h("span.count", {}, h("button", { type: "button", "aria-label": `Fewer ${words}`, dataset: { key: `${key}-fewer` }, onclick: () => to(editor[key] - 1) }, icon("minus")),
      h("input.field", { type: "number", min: "1", max: String(MOST_ROWS), value: String(editor[key]), "aria-label": `Number of ${words}`, dataset: { key }, onchange: (event) => to(Number(event.currentTarget.value)), onkeydown: (event) => {
        if (event.key !== "Enter") return;
        to(Number(event.currentTarget.value));
        editor.inTurn(() => editor.act());
      } }),
      h("button", { type: "button", "aria-label": `More ${words}`, dataset: { key: `${key}-more` }, onclick: () => to(editor[key] + 1) }, icon("plus")), h("span", {}, words));
  }

  // Instead of rows and columns: how wide the cells should be, as nearly as fits.
  cells() {
    const { editor } = this;
    const to = (field) => editor.set({ cell: Math.max(0, Number(field.value) || 0) });
    return h("label.count.cells", {}, h("span", {}, "or cells of"), h("input.field", { type: "number", min: "0", step: "any", value: editor.cell ? String(editor.cell) : "", placeholder: "\u2013", "aria-label": "Width of a cell in cm", dataset: { key: "cell" }, onchange: (event) => to(event.currentTarget), onkeydown: (event) => {
      if (event.key !== "Enter") return;
      to(event.currentTarget);
      editor.inTurn(() => editor.act());
    } }), h("span", {}, "cm"));
  }

  destination() {
    const { editor } = this;
    const neighbours = editor.region(editor.piece.region)?.neighbours ?? [];
    const choice = (value, words) => h("option", { value: String(value), selected: String(editor.to) === String(value) }, words);
    return h("label.destination", {}, "to", h("select.select", { dataset: { key: "to" }, onchange: ({ currentTarget: { value } }) => editor.set({ to: value === "null" ? null : value === "new" ? "new" : Number(value) }) },
      choice("null", `${editor.piece.to_name ?? "its neighbour"} (shares most border)`), neighbours.filter((id) => id !== editor.piece.to).map((id) => choice(id, regionNames(editor, [id]))), choice("new", "a region of its own")));
  }
}
