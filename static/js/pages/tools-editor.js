// What is being edited: the mode, the selection, the clicked points, and the requests that change the regions. The server keeps
// selection and points per 3D view, so the view, the table and the keyboard are three hands on one thing.

import { post } from "../api.js";
import { MODES } from "./tools-modes.js";

const NOTHING = { selection: [], points: [], level: 1, piece: null };
const OUTDATED = 412;

export class Editor {
  // onChange() after every change; onTool(tool) with what an edit answered; onRename(region) asks for a name.
  constructor({ onChange, onTool, onRename, onOutdated }) {
    Object.assign(this, { onChange, onTool, onRename, onOutdated }, NOTHING);
    this.view = null;
    this.tool = null;
    this.regions = [];
    this.wanted = []; // the selection, before what is not known is left out
    this.mode = "select";
    this.rows = 2;
    this.columns = 3;
    this.cell = 0; // about how wide cells of a grid are, cm; 0: rows and columns count
    this.closed = false;
    this.colours = "regions"; // or "cad": as painted in the file
    this.to = null;
    this.hovered = null;
    this.busy = "";
    this.fault = "";
    this.waiting = []; // what was pressed while an edit was under way
    this.running = false;
  }

  attach(view) {
    this.view = view;
    view.onEditing((state) => this.take(state));
    view.onUnder((region) => this.hover(region, true));
  }

  region(id) {
    return this.regions[id];
  }

  get possible() {
    return Boolean(this.tool?.edit?.editable);
  }

  get whyNot() {
    return this.tool?.edit?.why_not || (this.tool?.edit ? "" : "The regions of this tool cannot be edited.");
  }

  // Keys and buttons act one after the other, in the order they were pressed: those pressed while an edit is under way wait for it.
  // What waits for a refused edit was meant for regions that there are not, and is forgotten; so is what was meant for another tool.
  inTurn(run) {
    const { id } = this.tool;
    this.waiting.push(() => (this.tool?.id === id ? run() : null));
    if (!this.running) this.takeTurns();
  }

  async takeTurns() {
    this.running = true;
    while (this.waiting.length) if ((await this.waiting.shift()()) === false) this.waiting = [];
    this.running = false;
  }

  // A region by its row or letter; numbers may change until it is its turn, names stay.
  pick(id, toggled = false) {
    const name = this.region(id)?.name;
    this.inTurn(() => {
      const now = this.regions.findIndex((region) => region.name === name);
      if (now >= 0) (toggled ? this.toggle(now) : this.select([now]));
    });
  }

  get missing() {
    return MODES[this.mode].missing?.(this) ?? "";
  }

  // Another tool or another cut of it. The selection of a new cut comes from the server, mapped from the old one.
  show(tool, regions) {
    const other = tool.id !== this.tool?.id;
    this.tool = tool;
    this.regions = regions;
    if (!other) return this.keep();
    this.wanted = [];
    return Object.assign(this, NOTHING, { mode: "select", fault: "", to: null, hovered: null });
  }

  // The server may tell of a selection before the regions it is about have been read: what is not known yet waits.
  keep() {
    this.selection = this.wanted.filter((id) => id < this.regions.length);
  }

  // The view's state, told by the server.
  take(state) {
    const before = this.points.length;
    const shown = JSON.stringify([this.selection, this.points, this.level]);
    for (const key of ["points", "level"]) if (state[key] !== undefined) this[key] = state[key];
    if (state.selection) this.wanted = state.selection;
    this.keep();
    if ("piece" in state) this.piece = state.piece && { ...state.piece, name: this.region(state.piece.region)?.name ?? "A patch outside the working surface" };
    if (shown !== JSON.stringify([this.selection, this.points, this.level])) this.fault = "";
    this.onChange();
    if (this.mode === "surface" && this.points.length > before) this.inTurn(() => this.act());
    if (this.mode === "rename") this.rename();
  }

  change(values) {
    Object.assign(this, values);
    if (values.selection) this.wanted = values.selection;
    this.fault = "";
    this.tell(values);
    this.onChange();
  }

  tell(values) {
    if (this.tool?.edit) this.view?.change(values);
  }

  select(ids) {
    this.change({ selection: ids });
    if (this.mode === "rename") this.rename();
  }

  toggle(id) {
    this.select(this.selection.includes(id) ? this.selection.filter((other) => other !== id) : [...this.selection, id]);
  }

  // fromView: the view has drawn it already.
  hover(id, fromView = false) {
    if (this.hovered === id) return;
    this.hovered = id;
    if (!fromView) this.tell({ hover: id });
    this.onChange("hover");
  }

  enter(name) {
    if (!this.possible && !["select", "box"].includes(name)) return;
    const { pointing, path = null, atOnce } = MODES[name];
    const same = this.mode === name;
    this.mode = name;
    this.view?.boxing(Boolean(MODES[name].box));
    if (atOnce && !this.missing) return this.act();
    if (same && pointing === "select") return this.change({});
    this.to = null;
    this.closed = false;
    this.change({ pointing, path, points: [], level: 1, closed: false, ...(pointing === "points" ? { selection: [] } : {}) });
    this.piece = null;
    if (name === "rename") this.rename();
    return undefined;
  }

  // Escape: first the points, then the mode, then the selection.
  leave() {
    if (this.points.length && this.mode !== "select") return this.change({ points: [], level: 1, piece: null });
    if (this.mode !== "select") return this.enter("select");
    return this.change({ selection: [] });
  }

  get leavable() {
    return this.mode !== "select" || this.selection.length > 0;
  }

  get painted() {
    return this.regions.some((region) => region.colour);
  }

  paint() {
    if (this.painted) this.change({ colours: this.colours === "cad" ? "regions" : "cad" });
  }

  backspace() {
    if (this.points.length) this.change({ points: this.points.slice(0, -1), piece: null });
  }

  set(values) {
    Object.assign(this, values);
    if ("closed" in values) this.tell({ closed: this.closed });
    this.onChange();
  }

  // Confirms the mode: asks the server for the edit.
  async act() {
    const mode = MODES[this.mode];
    if (!mode.edit) return null;
    if (this.missing) {
      this.fault = `${this.missing}.`;
      this.onChange();
      return false;
    }
    const done = await this.edit(mode.edit(this), mode.words(this) || mode.name);
    if (done && mode.once) this.enter("select");
    return done;
  }

  async edit(edit, words) {
    return this.ask(words, "/segmentations", { edit, segmentation_id: this.tool.segmentation_id });
  }

  undo() {
    return this.tool?.edit?.can_undo ? this.ask("Undoing", "/segmentations/undo") : null;
  }

  redo() {
    return this.tool?.edit?.can_redo ? this.ask("Redoing", "/segmentations/redo") : null;
  }

  restore(segmentation) {
    return this.ask("Going back", `/segmentations/${encodeURIComponent(segmentation)}/restore`);
  }

  // Only in turn; a refusal stays in words beside the tools until something changes.
  async ask(words, path, body = {}) {
    const { id } = this.tool;
    this.busy = words;
    this.fault = "";
    this.onChange();
    let fault = "";
    try {
      const tool = await post(`/tools/${encodeURIComponent(id)}${path}`, body);
      this.points = [];
      this.piece = null;
      this.busy = "";
      await this.onTool(tool);
      await this.view?.tellAgain(); // what is selected now; the event of it may come later
    } catch (error) {
      fault = error.message;
      if (error.status === OUTDATED) this.onOutdated();
      else if (this.mode === "surface") {
        this.points = [];
        this.tell({ points: [] });
      }
    }
    this.busy = "";
    this.fault = fault;
    this.onChange();
    return !fault;
  }

  rename() {
    if (this.mode !== "rename" || this.selection.length !== 1) return;
    this.mode = "select";
    this.onChange();
    this.onRename(this.selection[0]);
  }
}
