// The saved demonstrations of the project: replay, rename, delete with undo, record again; those on an older cut of their tool say
// so and can be carried over where every region still has its counterpart.

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

  get authors() {
    return this.items.filter((item) => item.source !== "scripted" && item.author).map((item) => item.author);
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
    const facts = [item.name === item.tool_name ? "" : item.tool_name, SOURCES[item.source] ?? item.source, ago(item.created_at), item.superseded_by ? "replaced by a newer one" : ""].filter(Boolean).join(", ");
    const name = renameable(item.name, "demonstration", async (wanted) => {
      await patch(`/demonstrations/${item.id}`, { name: wanted }, item.version);
      await this.load();
    });
    name.classList.add("demo-name");
    const whose = this.whose(item);
    const old = item.on_current_cut === false && !item.superseded_by;
    const replay = item.on_current_cut === false ? this.button(item, "play", "Replay", null, "Recorded on an older cut of this tool; the 3D view shows the regions of today") : this.button(item, "play", "Replay", () => this.onReplay(item));
    return h(`li${item.superseded_by ? ".old" : ""}`, { dataset: { demonstration: item.id } }, name, h("span.demo-facts", {}, whose, facts),
      h("span.demo-actions", {}, replay, item.superseded_by ? null : this.button(item, "again", "Record again", () => this.onAgain(item)), this.button(item, "trash", "Delete", () => this.discard(item))),
      old ? this.older(item) : item.on_current_cut === false ? null : strip(item.sequence, this.regions.get(item.tool_id) ?? []));
  }

  // Shown once somebody has given a name: only then there is someone to mix up.
  whose(item) {
    if (!this.authors.some((author) => author !== "Expert")) return null;
    const name = renameable(item.author ?? "no name", "author", async (wanted) => {
      await patch(`/demonstrations/${item.id}`, { author: wanted }, item.version);
      await this.load();
    });
    return ["by ", name, ", "];
  }

  button(item, mark, words, run, reason = "") {
    return h("button.icon-btn", { type: "button", "aria-label": `${words}: ${item.name}`, "aria-disabled": run ? null : "true", dataset: { tip: reason || words, key: `${mark}-${item.id}` }, onclick: () => run?.() }, icon(mark));
  }

  // The regions have changed since: what happened to them, and the way on.
  older(item) {
    const words = item.can_carry_over ? "Recorded on an older cut. Every region still has its counterpart." : `Recorded on an older cut. ${item.why}`;
    return h("div.note.warn.demo-older", {}, icon("history"), h("p", {}, words), item.can_carry_over ? h("button.btn.small", { type: "button", dataset: { key: `carry-${item.id}` }, onclick: () => this.carry(item) }, "Carry over") : null);
  }

  async carry(item) {
    try {
      const carried = await post(`/demonstrations/${encodeURIComponent(item.id)}/carry-over`);
      toast(`${carried.name} carried over to the regions of today`);
    } catch (error) {
      complain(error);
    }
    return this.load();
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
