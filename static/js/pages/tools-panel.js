// The panel beside the 3D view: tabs for regions, history and (in narrow windows) all tools; while a tool is being imported its
// questions, its progress, or why it failed.

import { fill, h } from "../dom.js";
import { icon } from "../icons.js";
import { plural } from "../words.js";
import { importQuestions } from "./import_questions.js";
import { reportList } from "./import_report.js";
import { CutPanel } from "./tools-cut.js";
import { History, OldDemonstrations } from "./tools-history.js";
import { RegionTable } from "./tools-regions.js";

export class ToolPanel {
  // list: the node with all tools, shown here as a tab unless the window is wide enough for a column of its own.
  constructor({ editor, list, onChanged, onLook, onCut, onCarried, reload }) {
    Object.assign(this, { editor, list, onChanged, onLook, reload });
    this.table = new RegionTable(editor, { onRenamed: reload });
    this.history = new History(editor);
    this.old = new OldDemonstrations({ onCarried });
    this.cut = new CutPanel({ editor, onTool: onCut });
    this.tabs = h("div.segmented", { role: "group", "aria-label": "What the panel shows" });
    this.export = h("a.icon-btn.push", { "aria-label": "Download the regions as CSV", dataset: { tip: "Download the regions as CSV", key: "csv" }, download: "" }, icon("download"));
    this.body = h("div.fill", { style: { flex: "1" } });
    this.node = h("aside.card.fill", { "aria-label": "Tool" }, h("div.card-head", {}, this.tabs, this.export), this.body);
    this.regions = [this.old.node, this.table.node, this.cut.node];
    this.tab = "regions";
    this.wide = false;
    this.inside = "";
  }

  show(tool) {
    this.tool = tool;
    this.drawTabs();
    const tab = this.tab === "tools" && !this.wide ? "tools" : tool.state === "ready" ? this.tab.replace("tools", "regions") : tool.state;
    const inside = tab === "asking" ? `asking:${tool.id}:${JSON.stringify(tool.questions)}` : tab === "failed" ? `failed:${tool.id}` : tab;
    if (inside !== this.inside) {
      this.inside = inside;
      fill(this.body, this.content(tab, tool));
    }
    if (tool.job) this.progress(tool.job);
    if (tool.state !== "ready") return;
    this.table.draw();
    this.cut.show(tool);
  }

  content(tab, tool) {
    if (tab === "tools") return this.list;
    if (tab === "asking") return h("div.scroll", {}, importQuestions(tool, { onChanged: this.onChanged, reload: this.reload, onLook: this.onLook }));
    if (tab === "importing") return this.importing(tool);
    if (tab === "failed") return this.failed(tool);
    return tab === "history" ? this.history.node : this.regions;
  }

  // Reads what belongs to the cut that is shown.
  async load(tool) {
    await Promise.all([this.history.load(tool), this.old.load(tool)]);
  }

  mark() {
    this.table.mark();
  }

  choose(tab) {
    this.tab = tab;
    this.show(this.tool);
  }

  drawTabs() {
    const ready = this.tool.state === "ready";
    const tab = (key, words) => h("button", { type: "button", "aria-pressed": String(this.tab === key || (key === "regions" && this.tab === "tools" && this.wide)), dataset: { key: `tab-${key}` }, onclick: () => this.choose(key) }, words);
    fill(this.tabs, tab("regions", ready ? plural(this.tool.region_count, "region") : "Import"), ready && this.tool.edit ? tab("history", "History") : null, this.wide ? null : tab("tools", "All tools"));
    this.export.hidden = !ready;
    this.export.href = `/api/v1/tools/${encodeURIComponent(this.tool.id)}/regions.csv`;
  }

  importing(tool) {
    const words = h("span", {}, tool.job?.message || "Reading the file");
    const bar = h("div.progress", { role: "progressbar", "aria-label": "Import", "aria-valuemin": 0, "aria-valuemax": 100 }, h("i"));
    this.bar = { words, bar };
    return h("div.card-body", {}, h("div.progress-line", { role: "status" }, words, h("span"), bar), h("p.small.muted", { style: { "margin-top": "var(--s-3)" } }, "You can go on with another tool meanwhile."));
  }

  progress(job) {
    if (!this.bar?.bar.isConnected) return;
    const percent = Math.round(job.fraction * 100);
    if (job.message) this.bar.words.textContent = job.message;
    this.bar.bar.style.setProperty("--value", `${percent}%`);
    this.bar.bar.setAttribute("aria-valuenow", percent);
  }

  failed(tool) {
    return h("div.card-body.stack", {}, h("div.note.bad", { role: "alert" }, icon("warn"), h("p", {}, tool.error?.detail ?? "The import failed.")),
      h("p.small.muted", {}, "Nothing was kept of it but this entry. Delete it, or upload a corrected file."), tool.report.length ? reportList(tool.report) : null);
  }
}
