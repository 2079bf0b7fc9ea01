// What has to stay on the teach page whatever the run does: rows of a file that didn't count, and tools whose order it waits for.

import { fill, h } from "../dom.js";
import { icon } from "../icons.js";
import { pageAddress } from "../shell.js";

export class Notes {
  constructor({ projectId, report }) {
    this.projectId = projectId;
    this.shown = h("div");
    this.node = h("div", {}, report, this.shown);
  }

  show(run) {
    const tools = run?.to_show ?? [];
    const link = (tool, i) => [i ? ", " : " ", h("a", { href: pageAddress(this.projectId, "record", { tool: tool.tool_id }), dataset: { key: `show-${tool.tool_id}` } }, `record ${tool.tool_name}`)];
    fill(this.shown, tools.length ? h("div.note.warn", {}, icon("warn"), h("p", {}, "Both orders were wrong, so show yours:", tools.map(link), ". Learning goes on with it, nothing starts over.")) : null);
  }
}
