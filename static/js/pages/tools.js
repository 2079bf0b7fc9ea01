// Tools: uploads by button or drop, the tool in 3D with its regions, and everything that changes these regions.

import { all, get, patch, post, remove } from "../api.js";
import { fill, h } from "../dom.js";
import { gathered, listen } from "../events.js";
import { icon } from "../icons.js";
import { bind } from "../keys.js";
import { renameable } from "../rename.js";
import { boot, pageAddress, query, remember, showFault } from "../shell.js";
import { complain, toast } from "../toasts.js";
import { View3D } from "../view3d.js";
import { plural, sentence, spoken } from "../words.js";
import { uploadExtras } from "./import_questions.js";
import { letterKeys } from "./region-letters.js";
import { Editor } from "./tools-editor.js";
import { KINDS, drawTools } from "./tools-list.js";
import { MODES } from "./tools-modes.js";
import { ToolPanel } from "./tools-panel.js";
import { Toolbar } from "./tools-toolbar.js";
import { CAD, Uploads } from "./tools-upload.js";

const WIDE = "(min-width: 1500px)";

const shell = await boot();
const state = { tools: [], tool: null, view: null };
const uploads = new Uploads({ projectId: shell.projectId, onDone: async (tool) => {
  await load(tool.id);
} });
const editor = new Editor({ onChange: repaint, onTool: replaceTool, onRename: (region) => {
  panel.choose("regions");
  panel.table.edit(region);
}, onOutdated: () => freshen(state.tool.id) });
const toolbar = new Toolbar(editor);
const tools = h("div.tool-list");
const list = h("div.fill", { style: { flex: "1" } }, h("div.scroll", {}, tools), uploadExtras());
const column = h("nav.card.fill", { "aria-label": "Tools" });
const panel = new ToolPanel({ editor, list, onChanged: (tool) => replaceTool(tool).catch(complain), onLook: lookAt, onCut: async (tool) => {
  await replaceTool(tool);
  editor.select([]);
}, onCarried: () => load(), reload: () => load().catch(complain) });
const head = h("div.head");
const cover = h("div.empty", { hidden: true });
const stage = h("section.stage", { "aria-label": "3D view" }, h("div.tl", {}, toolbar.hint), h("div.bc", {}, toolbar.finish), cover);
const body = h("div.tools-frame", {}, h("div.workbench", {}, toolbar.node, stage), panel.node);

// ---- painting ----------------------------------------------------------------------------------------------------------------

function nextWords(tool) {
  if (tool.state === "asking") return { kicker: "Next: answer on the right", words: "then it is cut into regions" };
  if (tool.state !== "ready") return null;
  if (panel.old.carriable) return { kicker: "Next: carry it over", words: "its demonstration is on an older cut", run: () => panel.old.carry(panel.old.carriable), label: "Carry over" };
  const record = pageAddress(shell.projectId, "record", { tool: tool.id });
  if (panel.old.items.length) return { kicker: "Next: record it again", words: "its demonstration is on an older cut", href: record, label: "Record it" };
  if (tool.demonstrated) return { calm: true, kicker: "", words: "It has a demonstration", href: record, label: "Show its order" };
  return { kicker: "Next: record it", words: `once its ${plural(tool.region_count, "region")} look right`, href: record, label: "Record it" };
}

// Only one thing is orange: while a mode waits to be finished, its button.
function nextStep() {
  const next = state.tool && nextWords(state.tool);
  if (!next) return null;
  const editing = MODES[editor.mode].edit && !editor.missing;
  const tone = next.calm || editing ? "" : ".primary";
  const button = next.href ? h(`a.btn${tone}`, { href: next.href, dataset: { key: "next" } }, next.label) : next.run ? h(`button.btn${tone}`, { type: "button", dataset: { key: "next" }, onclick: next.run }, next.label) : null;
  return h(`div.next${next.calm || editing ? ".calm" : ""}`, {}, h("p", {}, h("span.kicker", {}, next.kicker), next.words), button);
}

function titleOf(tool) {
  const ready = state.tools.filter((entry) => entry.state === "ready").length;
  const done = state.tools.filter((entry) => entry.demonstrated).length;
  const count = `${sentence(spoken(ready, "tool"))} ready, ${done} demonstrated.`;
  const name = renameable(tool.name, "tool", async (wanted) => replaceTool(await patch(`/tools/${encodeURIComponent(tool.id)}`, { name: wanted }, state.tool.version)), "h1.rename");
  return h("div.title", {}, name, h("p", {}, `${sentence(KINDS[tool.kind])}${tool.file_name ? `, ${tool.file_name}` : ""}. ${count}`));
}

let headShown = "";

function drawHead() {
  const { tool } = state;
  const key = JSON.stringify([tool, state.tools.map((entry) => [entry.state, entry.demonstrated]), panel.old.items, editor.mode, editor.missing]);
  if (key === headShown || head.querySelector(".title input")) return;
  headShown = key;
  fill(head, tool ? titleOf(tool) : h("div.title", {}, h("h1", {}, "Tools"), h("p", {}, "The parts you work on.")),
    h("span", { style: { "margin-left": "auto" } }), h("div.head-actions", {}, h("button.btn", { type: "button", dataset: { key: "upload", tip: `${CAD.map((end) => end.slice(1).toUpperCase()).join(", ")}` }, onclick: () => uploads.cad.click() }, icon("upload"), "Upload"),
      h("button.icon-btn", { type: "button", "aria-label": "Import a region table", dataset: { key: "table", tip: "Import a region table (CSV or JSON)" }, onclick: () => uploads.table.click() }, icon("table")),
      tool ? h("button.icon-btn", { type: "button", "aria-label": `Delete ${tool.name}`, dataset: { tip: "Delete this tool", key: "delete" }, onclick: () => discard(tool).catch(complain) }, icon("trash")) : null), nextStep());
  head.querySelector(".next")?.style.setProperty("margin-left", "0");
}

function asked({ units, up, body } = {}) {
  const words = [body && "which body is it", units && "how large is it", up && "which way is up"].filter(Boolean);
  return `${sentence(words.length > 1 ? `${words.slice(0, -1).join(", ")}, and ${words.at(-1)}` : (words[0] ?? "what is it"))}?`;
}

const MOST_SHOWN = 300_000; // triangles; the server draws no more of a file that is not read in

const COVERS = {
  asking: (tool) => (tool.bodies.reduce((sum, body) => sum + body.faces, 0) > MOST_SHOWN ? [asked(tool.questions ?? {}), askedWords(tool)] : null),
  importing: (tool) => ["Cutting it into regions", tool.job?.message || "This takes a few seconds."],
  failed: () => ["There is nothing to show", "The file could not be used; the reason is on the right."],
};

const askedWords = (tool) => `${tool.file_name ?? tool.name} does not say. Answer on the right, then it is cut into regions.`;

// The file as it would stand by the answers so far.
function drawFile(tool) {
  const { body, up } = tool.questions ?? {};
  if (state.look?.tool !== tool.id) state.look = { tool: tool.id, body: body?.guess ?? tool.body, up: up?.guess ?? tool.up, highlight: [] };
  const { tool: id, ...look } = state.look;
  return state.view.show({ mode: "file", tool_id: id, ...look }, `3D view of the file ${tool.file_name ?? tool.name} with ${look.up} up`);
}

function lookAt(values) {
  if (state.tool?.state !== "asking") return;
  for (const [key, value] of Object.entries(values)) if (value !== null) state.look[key] = value;
  drawFile(state.tool);
}

function drawStage() {
  const { tool } = state;
  const words = COVERS[tool.state]?.(tool);
  cover.hidden = !words;
  toolbar.node.hidden = !tool.edit || tool.state !== "ready";
  if (words) fill(cover, h("h2", {}, words[0]), h("p", {}, words[1]));
  if (tool.state === "asking" && !words) return drawFile(tool);
  if (tool.state !== "ready") return state.view.show({ mode: "empty", tool_id: null }, "No tool is shown");
  return state.view.show({ mode: tool.edit ? "edit" : "tool", tool_id: tool.id, ...(tool.edit ? { colours: editor.painted ? editor.colours : "regions" } : {}) }, `3D view of ${tool.name} with ${plural(tool.region_count, "lettered region")}`);
}

function draw() {
  const { tool } = state;
  drawTools(tools, state.tools, tool.id, (id) => open(id).catch(complain));
  shell.crumb(tool.name, () => state.tools.map((entry) => ({ label: entry.name, note: KINDS[entry.kind], current: entry.id === tool.id, run: () => open(entry.id).catch(complain) })));
  drawStage();
  repaint();
}

// What follows the editor; a mere hover touches no more than the row.
function repaint(what = "") {
  if (!state.tool) return;
  if (what === "hover") return panel.mark();
  toolbar.draw();
  if (state.tool.state === "asking") toolbar.hint.textContent = `${asked(state.tool.questions)} ${askedWords(state.tool)}`;
  panel.show(state.tool);
  return drawHead();
}

// ---- reading and changing ------------------------------------------------------------------------------------------------------

async function readRegions(tool) {
  if (tool.state !== "ready") return editor.show(tool, []);
  const regions = await all(`/tools/${encodeURIComponent(tool.id)}/regions`);
  if (state.tool?.id !== tool.id) return undefined;
  panel.load(tool).then(() => repaint()).catch(complain);
  return editor.show(tool, regions.sort((a, b) => a.id - b.id));
}

async function open(id) {
  const tool = state.tools.find((entry) => entry.id === id);
  if (!tool) return;
  const other = tool.id !== state.tool?.id;
  state.tool = tool;
  if (other && panel.tab === "tools") panel.tab = "regions";
  remember("tool", id);
  await readRegions(tool);
  if (state.tool.id !== id) return;
  draw();
  if (other && tool.state === "ready") editor.enter("select");
  tools.querySelector("[aria-current]")?.scrollIntoView({ block: "nearest" });
}

async function replaceTool(tool) {
  const at = state.tools.findIndex((entry) => entry.id === tool.id);
  if (at >= 0) state.tools[at] = tool;
  if (state.tool?.id !== tool.id) return drawTools(tools, state.tools, state.tool?.id, (id) => open(id).catch(complain));
  state.tool = tool;
  await readRegions(tool);
  return draw();
}

async function discard(tool) {
  await remove(`/tools/${encodeURIComponent(tool.id)}`, tool.version);
  const at = state.tools.findIndex((entry) => entry.id === tool.id);
  const next = state.tools[at + 1]?.id ?? state.tools[at - 1]?.id;
  state.tool = null;
  await load(next);
  toast(`${tool.name} deleted`, { undo: async () => {
    await post(`/tools/${encodeURIComponent(tool.id)}/restore`);
    await load(tool.id);
  } });
}

async function load(wanted) {
  state.tools = await all(`/projects/${encodeURIComponent(shell.projectId)}/tools`);
  const id = wanted ?? state.tool?.id; // asked after reading: an upload may have opened its tool meanwhile
  const tool = state.tools.find((entry) => entry.id === id) ?? state.tools[0];
  if (!tool) return showEmpty();
  if (!body.isConnected) {
    fill(shell.main, head, body, uploads.inputs);
    arrange(); // the rows of the uploads come back from the empty page
  }
  if (!state.view) {
    state.view = new View3D(stage, { projectId: shell.projectId, name: "tools" });
    editor.attach(state.view);
    state.view.onPicked((number) => panel.node.querySelector(`.ask-form [name="body"][value="${number + 1}"]`)?.click());
    state.view.onUp((direction) => panel.node.querySelector(`.ask-form [name="up"][value="${direction}"]`)?.click());
  }
  await open(tool.id);
  return undefined;
}

function showEmpty() {
  state.tool = null;
  headShown = "";
  drawHead();
  fill(shell.main, head, h("div.empty", { style: { flex: "1", "align-content": "center" } }, icon("cube"), h("h2", {}, "Bring the first part"),
    h("p", {}, "Drop a STEP, STL, OBJ, PLY, GLB or 3MF file here, or a region table. It is cleaned and cut into regions."),
    h("button.btn.primary", { type: "button", onclick: () => uploads.cad.click() }, "Upload a tool")), uploads.node, uploads.inputs);
}

// One tool changed: read that one, not all.
async function freshen(id) {
  try {
    const tool = await get(`/tools/${encodeURIComponent(id)}`);
    const known = state.tools.find((entry) => entry.id === id);
    if (!known) await load();
    else if (JSON.stringify(known) !== JSON.stringify(tool) || id === state.tool?.id) await replaceTool(tool);
  } catch (error) {
    if (error.status === 404) await load();
    else complain(error);
  }
}

function progress(id, job) {
  const tool = state.tools.find((entry) => entry.id === id);
  if (!tool || tool.state !== "importing") return;
  tool.job = job;
  drawTools(tools, state.tools, state.tool?.id, (other) => open(other).catch(complain));
  if (tool.id !== state.tool?.id) return;
  panel.progress(job);
  drawStage();
}

// The list of tools has a column of its own in a wide window; in a narrow one it is a tab of the panel.
function arrange() {
  const wide = matchMedia(WIDE).matches;
  if (wide) {
    fill(column, h("div.card-head", {}, h("h2", {}, "All tools")), uploads.node, list);
    body.prepend(column);
  } else {
    column.remove();
    panel.node.insertBefore(uploads.node, panel.body);
  }
  panel.wide = wide;
  panel.inside = "";
  if (state.tool) panel.show(state.tool);
}

async function start() {
  arrange();
  matchMedia(WIDE).addEventListener("change", arrange);
  await load(query("tool") ?? shell.project.next_step.tool_id);
  uploads.acceptDrops(shell.main);
  letterKeys({ regions: () => editor.regions, pick: (region) => editor.pick(region), name: "Select a region" });
  bind({ key: "u", ctrl: false, alt: true, shown: "Alt U", name: "Upload a tool", run: () => uploads.cad.click() });
  listenToAll();
}

function listenToAll() {
  const changed = new Set();
  const fresh = gathered(() => {
    for (const id of changed) freshen(id);
    changed.clear();
  }, 150);
  const about = ({ tool_id: id }) => {
    changed.add(id);
    fresh();
  };
  listen("tool.changed", about);
  listen("demonstration.changed", about);
  listen("job.progress", ({ subject_id: id, job_id: job, fraction, message }) => progress(id, { id: job, fraction, message }));
  listen("resync", () => load().catch(complain));
  addEventListener("themechange", () => state.tool && draw());
}

try {
  await start();
} catch (error) {
  showFault(shell.main, error);
  throw error;
}
