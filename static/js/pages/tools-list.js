// The list of a project's tools with where each stands, and what has just been dropped on the page.

import { fill, h } from "../dom.js";
import { icon } from "../icons.js";
import { plural, sentence } from "../words.js";

export const KINDS = { cad: "CAD", table: "region table", sample: "sample" };
const MARKS = { asking: ["info", "ask"], importing: ["half", ""], failed: ["warn", "bad"] };
const STATE_WORDS = { asking: "asks a question", importing: "being cut", failed: "could not be read" };

function row(tool, current, onOpen) {
  const words = tool.state === "ready" ? [plural(tool.region_count, "region"), tool.split ?? KINDS[tool.kind]].join(", ") : STATE_WORDS[tool.state];
  const [name, tone] = MARKS[tool.state] ?? (tool.demonstrated ? ["check", "ok"] : ["ring", ""]);
  const tip = tool.state === "ready" ? (tool.demonstrated ? "Demonstrated" : "Not demonstrated yet") : sentence(STATE_WORDS[tool.state]);
  const percent = Math.round((tool.job?.fraction ?? 0) * 100);
  return h("a", { href: `?tool=${encodeURIComponent(tool.id)}`, dataset: { key: `tool-${tool.id}`, tip }, "aria-current": tool.id === current ? "true" : null, onclick: (event) => {
    event.preventDefault();
    onOpen(tool.id);
  } }, h("span.tool-name", {}, tool.name), h("small", {}, words), icon(name, tone), h("span.visually-hidden", {}, tip),
  tool.state === "importing" ? h("div.progress", { style: { "--value": `${percent}%` } }, h("i")) : null);
}

export function drawTools(host, tools, current, onOpen) {
  fill(host, tools.map((tool) => row(tool, current, onOpen)));
}
