// The saved demonstrations of the project: replay, rename, delete with undo, record again.

import { all, patch, post, remove } from "../api.js";
import { fill, h } from "../dom.js";
import { icon } from "../icons.js";
import { renameable } from "../rename.js";
import { strip } from "../strip.js";
import { complain, toast } from "../toasts.js";
import { ago } from "../words.js";

const SOURCES = { recorded: "recorded", table: "from a region table", scripted: "by the scripted expert", rest: "sent by a program" };

export class SavedList {
  constructor({ projectId, onReplay, onAgain, onChange }) {
    this.projectId = projectId;
    this.onReplay = onReplay;
    this.onAgain = onAgain;
    this.onChange = onChange;
    this.node = h("ul.demo-list");
    this.items = [];
    this.regions = new Map();
  }

  get count() {
    return this.items.filter((item) => !item.superseded_by).length;
  }

  async load() {
    this.items = (await all(`/projects/${this.projectId}/demonstrations`)).filter((item) => !item.deleted);
    this.items.sort((a, b) => Boolean(a.superseded_by) - Boolean(b.superseded_by) || b.created_at.localeCompare(a.created_at));
    const missing = [...new Set(this.items.map((item) => item.tool_id))].filter((id) => !this.regions.has(id));
    await Promise.all(missing.map(async (id) => this.regions.set(id, await all(`/tools/${encodeURIComponent(id)}/regions`).catch(() => []))));
    if (!this.node.querySelector("input")) this.draw();
    this.onChange();
  }

  draw() {
    fill(this.node, this.items.length ? this.items.map((item) => this.row(item)) : h("li", { style: { display: "block" } }, h("div.empty", {}, h("h3", {}, "Nothing saved yet"), h("p", {}, "Number every region of a tool and save: the order appears here."))));
  }

  row(item) {
    const facts = [item.name === item.tool_name ? "" : item.tool_name, item.source === "recorded" && item.author ? `by ${item.author}` : (SOURCES[item.source] ?? item.source), ago(item.created_at), item.superseded_by ? "replaced by a newer one" : ""].filter(Boolean).join(", ");
    const name = renameable(item.name, "demonstration", async (wanted) => {
      await patch(`/demonstrations/${item.id}`, { name: wanted }, item.version);
      await this.load();
    });
    name.classList.add("demo-name");
    const button = (mark, words, run) => h("button.icon-btn", { type: "button", "aria-label": `${words}: ${item.name}`, dataset: { tip: words, key: `${mark}-${item.id}` }, onclick: run }, icon(mark));
    return h(`li${item.superseded_by ? ".old" : ""}`, { dataset: { demonstration: item.id } }, name, h("span.demo-facts", {}, facts),
      h("span.demo-actions", {}, button("play", "Replay", () => this.onReplay(item)), item.superseded_by ? null : button("again", "Record again", () => this.onAgain(item)), button("trash", "Delete", () => this.discard(item))),
      strip(item.sequence, this.regions.get(item.tool_id) ?? []));
  }

  async discard(item) {
    try {
      await remove(`/demonstrations/${item.id}`, item.version);
    } catch (error) {
      complain(error);
      return this.load();
    }
    toast(`${item.name} deleted`, { undo: async () => {
      await post(`/demonstrations/${item.id}/restore`);
      await this.load();
    } });
    return this.load();
  }
}
