// The history of a tool's regions: every cut and edit, the current one marked, a click goes there. And the demonstrations that
// were recorded on an older cut, with what keeps them from being used.

import { get, post } from "../api.js";
import { fill, h } from "../dom.js";
import { icon } from "../icons.js";
import { complain, toast } from "../toasts.js";
import { ago, plural } from "../words.js";
import { readAgain } from "./import_questions.js";
import { reportList } from "./import_report.js";

export class History {
  constructor(editor) {
    this.editor = editor;
    this.items = [];
    this.list = h("ol.history-list");
    this.others = h("details.more.pad-x");
    this.report = h("div");
    this.node = h("div.scroll", {}, this.list, this.others, this.report);
  }

  async load(tool) {
    const { items } = tool.edit ? await get(`/tools/${encodeURIComponent(tool.id)}/segmentations`) : { items: [] };
    if (this.editor.tool?.id !== tool.id) return;
    this.items = items;
    this.draw();
  }

  draw() {
    const line = this.items.filter((item) => !item.abandoned);
    const others = this.items.filter((item) => item.abandoned);
    fill(this.list, line.length ? line.map((item) => this.step(item)) : h("li.muted.small", {}, "Every cut and every edit will be listed here."));
    this.others.hidden = !others.length;
    fill(this.others, h("summary", {}, icon("right", "caret"), `${plural(others.length, "earlier attempt")}`), h("ol.history-list", {}, others.map((item) => this.step(item))));
    this.drawReport();
  }

  step(item) {
    const facts = [plural(item.region_count, "region"), item.demonstrations ? plural(item.demonstrations, "demonstration") : "", ago(item.created_at)].filter(Boolean).join(", ");
    const state = item.current ? ".now" : item.undone ? ".undone" : "";
    return h(`li${state}`, {}, h("button", { type: "button", "aria-current": item.current ? "step" : null, "aria-disabled": item.current || !this.editor.possible ? "true" : null, dataset: { key: `step-${item.id}`, tip: item.current ? "" : "Go back to this step; nothing is lost" }, onclick: () => !item.current && this.editor.possible && this.editor.inTurn(() => this.editor.restore(item.id)) },
      h("i.stop", { "aria-hidden": "true" }), h("span.words", {}, item.words), h("small", {}, facts)));
  }

  // A form that is being filled in is not replaced.
  drawReport() {
    const { tool } = this.editor;
    const key = `${tool.id} ${tool.version}`;
    if (this.reported === key && this.report.querySelector("details[open]")) return;
    this.reported = key;
    fill(this.report, tool.report.length ? [h("h3.report-title", {}, "How it was read"), reportList(tool.report)] : null, readAgain(tool));
  }
}

// Demonstrations of the tool that wait on an older cut: why, and one button that carries all that can be carried.
export class OldDemonstrations {
  constructor({ onCarried }) {
    this.onCarried = onCarried;
    this.node = h("div.old-demonstrations", { hidden: true });
    this.items = [];
  }

  async load(tool) {
    const { items } = tool.edit ? await get(`/tools/${encodeURIComponent(tool.id)}/demonstrations`) : { items: [] };
    this.items = items.filter((item) => !item.deleted && !item.superseded_by && item.on_current_cut === false);
    this.draw();
  }

  get carriable() {
    return this.items.find((item) => item.can_carry_over) ?? null;
  }

  draw() {
    const [first] = this.items;
    this.node.hidden = !first;
    if (!first) return;
    const ready = this.carriable;
    const words = ready ? [h("b", {}, ready.name), " was recorded on an older cut, and every region still has its counterpart."] : [h("b", {}, first.name), " was recorded on an older cut. ", first.why];
    fill(this.node, h("div.note.warn", {}, icon("history"), h("p", {}, words), ready ? h("button.btn.small", { type: "button", dataset: { key: "carry" }, onclick: () => this.carry(ready) }, "Carry over") : null));
  }

  async carry(item) {
    try {
      const carried = await post(`/demonstrations/${encodeURIComponent(item.id)}/carry-over`);
      toast(`${carried.name} carried over to the regions of today`);
      await this.onCarried();
    } catch (error) {
      complain(error);
    }
  }
}
