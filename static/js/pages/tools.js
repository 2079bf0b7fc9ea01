// Tools: the list, uploads by button or drop, and for the chosen tool its 3D view with lettered regions and its panel.

import { all, get, post, remove, upload } from "../api.js";
import { fill, h } from "../dom.js";
import { gathered, listen } from "../events.js";
import { icon } from "../icons.js";
import { bind } from "../keys.js";
import { boot, pageAddress, query, remember, showFault } from "../shell.js";
import { complain, toast } from "../toasts.js";
import { View3D } from "../view3d.js";
import { bytes, plural, sentence, spoken } from "../words.js";
import { letterKeys } from "./region-letters.js";
import { ToolPanel } from "./tools-panel.js";

const CAD = [".step", ".stp", ".iges", ".igs", ".stl", ".obj", ".ply", ".off", ".glb", ".3mf"];
const KINDS = { cad: "CAD", table: "region table", sample: "sample" };

const shell = await boot();
const state = { tools: [], tool: null, regions: [], highlight: null, uploads: [], view: null, segmentation: null };
const head = h("div.head");
const list = h("div.tool-list");
const sending = h("div", { role: "status" });
const stage = h("section.stage", { "aria-label": "3D view" });
const caption = h("div.tl");
const cover = h("div.empty", { hidden: true });
const cad = h("input", { type: "file", hidden: true, multiple: true, id: "cad-file", accept: CAD.join(","), onchange: () => take(cad) });
const table = h("input", { type: "file", hidden: true, multiple: true, id: "table-file", accept: ".csv,text/csv", onchange: () => take(table) });
const panel = new ToolPanel({ onHighlight: highlight, onChanged: (tool) => replaceTool(tool), onDelete: () => discard(state.tool).catch(complain), reload: () => load().catch(complain) });

// ---- uploads -----------------------------------------------------------------------------------------------------------------

function take(input) {
  const files = [...input.files];
  input.value = "";
  sendAll(files, input === table);
}

async function sendAll(files, asTable = false) {
  for (const file of files) await sendOne(file, asTable || /\.csv$/i.test(file.name));
}

async function sendOne(file, asTable) {
  const entry = { name: file.name, size: file.size, fraction: 0, fault: "" };
  state.uploads.push(entry);
  drawUploads();
  try {
    const base = `/projects/${encodeURIComponent(shell.projectId)}/tools`;
    const tool = await upload(asTable ? `${base}/region-table` : base, { file }, (fraction) => {
      entry.fraction = fraction;
      drawUploads();
    });
    state.uploads.splice(state.uploads.indexOf(entry), 1);
    await load();
    await open(tool.id);
  } catch (error) {
    entry.fault = error.message;
  }
  drawUploads();
}

function dismiss(entry) {
  state.uploads.splice(state.uploads.indexOf(entry), 1);
  drawUploads();
}

function uploadRow(entry) {
  if (entry.fault) {
    return h("div.upload-row", {}, h("div.note.bad", { role: "alert" }, icon("warn"), h("span", {}, entry.fault.includes(entry.name) ? null : [h("b.strong", {}, entry.name), ": "], entry.fault)),
      h("button.btn.quiet.small", { type: "button", style: { "justify-self": "start" }, onclick: () => dismiss(entry) }, "Dismiss"));
  }
  const percent = Math.round(entry.fraction * 100);
  const words = entry.fraction < 1 ? bytes(entry.size) : "checking";
  return h("div.upload-row", {}, h("div.progress-line", {}, h("span", {}, entry.name), h("span.muted", {}, words),
    h("div.progress", { role: "progressbar", "aria-label": `Sending ${entry.name}`, "aria-valuemin": 0, "aria-valuemax": 100, "aria-valuenow": percent, style: { "--value": `${percent}%` } }, h("i"))));
}

const drawUploads = () => fill(sending, state.uploads.map(uploadRow));

function dropping() {
  const files = (event) => [...(event.dataTransfer?.types ?? [])].includes("Files");
  let depth = 0;
  const show = () => shell.main.classList.toggle("dropping", depth > 0);
  addEventListener("dragenter", (event) => {
    if (!files(event)) return;
    depth += 1;
    show();
  });
  addEventListener("dragleave", (event) => {
    if (!files(event)) return;
    depth = Math.max(0, depth - 1);
    show();
  });
  addEventListener("dragover", (event) => files(event) && event.preventDefault());
  addEventListener("drop", (event) => {
    if (!files(event)) return;
    event.preventDefault();
    depth = 0;
    show();
    sendAll([...event.dataTransfer.files]);
  });
}

// ---- painting ----------------------------------------------------------------------------------------------------------------

function nextStep() {
  const { tool } = state;
  if (!tool || tool.state !== "ready") return null;
  const known = tool.demonstrated;
  return h(`div.next${known ? ".calm" : ""}`, {}, h("p", {}, h("span.kicker", {}, known ? "" : "Next: record it"), known ? `${tool.name} has a demonstration` : `${tool.name} has ${plural(tool.region_count, "region")}`),
    h(`a.btn${known ? "" : ".primary"}`, { href: pageAddress(shell.projectId, "record", { tool: tool.id }), dataset: { key: "record" } }, known ? "Show its order" : "Record it"));
}

function drawHead() {
  const ready = state.tools.filter((tool) => tool.state === "ready").length;
  const done = state.tools.filter((tool) => tool.demonstrated).length;
  const words = state.tools.length ? `${sentence(spoken(ready, "tool"))} ready, ${done} demonstrated.` : "The parts you work on.";
  fill(head, h("div.title", {}, h("h1", {}, "Tools"), h("p", {}, words)), h("span", { style: { "margin-left": "auto" } }),
    h("button.btn", { type: "button", dataset: { key: "upload", tip: `${CAD.map((end) => end.slice(1).toUpperCase()).join(", ")}` }, onclick: () => cad.click() }, icon("upload"), "Upload"),
    h("button.btn", { type: "button", dataset: { key: "table", tip: "CSV in the layout of the published region tables" }, onclick: () => table.click() }, icon("table"), "Region table"), nextStep());
  head.querySelector(".next")?.style.setProperty("margin-left", "0");
}

const MARKS = { asking: ["info", "ask"], importing: ["half", ""], failed: ["warn", "bad"] };
const STATE_WORDS = { asking: "asks a question", importing: "importing", failed: "could not be read" };

function toolRow(tool) {
  const words = tool.state === "ready" ? [plural(tool.region_count, "region"), tool.split ?? KINDS[tool.kind]].join(", ") : STATE_WORDS[tool.state];
  const [name, tone] = MARKS[tool.state] ?? (tool.demonstrated ? ["check", "ok"] : ["ring", ""]);
  const tip = tool.state === "ready" ? (tool.demonstrated ? "Demonstrated" : "Not demonstrated yet") : sentence(STATE_WORDS[tool.state]);
  const percent = Math.round((tool.job?.fraction ?? 0) * 100);
  return h("a", { href: `?tool=${encodeURIComponent(tool.id)}`, dataset: { key: `tool-${tool.id}`, tip }, "aria-current": tool.id === state.tool?.id ? "true" : null, onclick: (event) => {
    event.preventDefault();
    open(tool.id).catch(complain);
  } }, h("span.tool-name", {}, tool.name), h("small", {}, words), icon(name, tone), h("span.visually-hidden", {}, tip),
  tool.state === "importing" ? h("div.progress", { style: { "--value": `${percent}%` } }, h("i")) : null);
}

function drawList() {
  fill(list, state.tools.map(toolRow));
}

const COVERS = {
  asking: (tool) => ["How large is it, and which way is up?", `${tool.file_name ?? tool.name} does not say. Answer on the right, then it is cut into regions.`],
  importing: (tool) => ["Cutting it into regions", tool.job?.message ?? "This takes a few seconds."],
  failed: () => ["There is nothing to show", "The file could not be used; the reason is on the right."],
};

function drawStage() {
  const { tool } = state;
  const words = tool ? COVERS[tool.state]?.(tool) : null;
  cover.hidden = !words;
  if (words) fill(cover, h("h2", {}, words[0]), h("p", {}, words[1]));
  fill(caption, tool?.state === "ready" ? h("span.hint.plate", {}, "Hover a row or click a region") : null);
  if (!tool || tool.state !== "ready") return state.view.show({ mode: "empty", tool_id: null }, "No tool is shown");
  return state.view.show({ mode: "tool", tool_id: tool.id, highlight: state.highlight === null ? [] : [state.highlight] }, `3D view of ${tool.name} with ${plural(tool.region_count, "lettered region")}`);
}

function draw() {
  drawHead();
  drawList();
  if (!state.tool) return;
  shell.crumb(state.tool.name, () => state.tools.map((tool) => ({ label: tool.name, note: KINDS[tool.kind], current: tool.id === state.tool.id, run: () => open(tool.id).catch(complain) })));
  panel.show(state.tool, state.regions, state.highlight);
  drawStage();
}

function highlight(region, fromView = false) {
  if (state.highlight === region) return;
  state.highlight = region;
  panel.mark(region, fromView);
  if (state.tool?.state === "ready") drawStage();
}

// ---- reading and changing ------------------------------------------------------------------------------------------------------

async function readRegions() {
  const { tool } = state;
  if (tool.state !== "ready") {
    state.regions = [];
    state.segmentation = null;
    return;
  }
  const regions = await all(`/tools/${encodeURIComponent(tool.id)}/regions`);
  if (state.tool.id !== tool.id) return;
  state.regions = regions.sort((a, b) => a.id - b.id);
  state.segmentation = tool.segmentation_id;
}

async function open(id) {
  const tool = state.tools.find((entry) => entry.id === id);
  if (!tool) return;
  state.tool = tool;
  state.highlight = null;
  remember("tool", id);
  await readRegions();
  draw();
  list.querySelector("[aria-current]")?.scrollIntoView({ block: "nearest" });
}

async function replaceTool(tool) {
  const at = state.tools.findIndex((entry) => entry.id === tool.id);
  if (at >= 0) state.tools[at] = tool;
  if (state.tool?.id !== tool.id) return drawList();
  state.tool = tool;
  await readRegions();
  return draw();
}

async function discard(tool) {
  await remove(`/tools/${encodeURIComponent(tool.id)}`, tool.version);
  const at = state.tools.findIndex((entry) => entry.id === tool.id);
  state.tool = null;
  await load(state.tools[at + 1]?.id ?? state.tools[at - 1]?.id);
  toast(`${tool.name} deleted`, { undo: async () => {
    await post(`/tools/${encodeURIComponent(tool.id)}/restore`);
    await load(tool.id);
  } });
}

async function load(wanted = state.tool?.id) {
  state.tools = await all(`/projects/${encodeURIComponent(shell.projectId)}/tools`);
  const tool = state.tools.find((entry) => entry.id === wanted) ?? state.tools[0];
  if (!tool) return showEmpty();
  if (!body.isConnected) fill(shell.main, head, body, cad, table);
  state.view ??= openView();
  await open(tool.id);
  return undefined;
}

function openView() {
  const view = new View3D(stage, { projectId: shell.projectId, name: "tools" });
  view.onPicked((region) => highlight(region, true));
  return view;
}

const body = h("div.tools-frame", {}, h("nav.card.fill", { "aria-label": "Tools" }, h("div.card-head", {}, h("h2", {}, "All tools")), sending, h("div.scroll", {}, list),
  h("p.drop-note", {}, "Drop CAD files or region tables anywhere on this page.")), stage, panel.node);
stage.append(caption, cover);

function showEmpty() {
  state.tool = null;
  drawHead();
  fill(shell.main, head, h("div.empty", { style: { flex: "1", "align-content": "center" } }, icon("cube"), h("h2", {}, "Bring the first part"),
    h("p", {}, "Drop a STEP, STL, OBJ, PLY, GLB or 3MF file here, or a region table. It is cleaned and cut into regions."),
    h("button.btn.primary", { type: "button", onclick: () => cad.click() }, "Upload a tool")), sending, cad, table);
}

// One tool changed: read that one, not all.
async function freshen(id) {
  try {
    const tool = await get(`/tools/${encodeURIComponent(id)}`);
    if (state.tools.some((entry) => entry.id === id)) await replaceTool(tool);
    else await load();
  } catch (error) {
    if (error.status === 404) await load();
    else complain(error);
  }
}

async function start() {
  await load(query("tool") ?? shell.project.next_step.tool_id);
  dropping();
  letterKeys({ regions: () => state.regions, pick: (region) => highlight(region, true), name: "Point at a region" });
  bind({ key: "u", ctrl: false, alt: true, shown: "Alt U", name: "Upload a tool", run: () => cad.click() });
  bind({ key: "Escape", name: "Point at nothing", when: () => state.highlight !== null, run: () => highlight(null) });
  const changed = new Set();
  const fresh = gathered(() => {
    for (const id of changed) freshen(id);
    changed.clear();
  }, 150);
  listen("tool.changed", ({ tool_id: id }) => {
    changed.add(id);
    fresh();
  });
  listen("job.progress", ({ subject_id: id, job_id: job, fraction, message }) => progress(id, { id: job, fraction, message }));
  listen("resync", () => load().catch(complain));
  addEventListener("themechange", draw);
}

function progress(id, job) {
  const tool = state.tools.find((entry) => entry.id === id);
  if (!tool || tool.state !== "importing") return;
  tool.job = job;
  drawList();
  if (tool.id === state.tool?.id) {
    panel.progress(job);
    drawStage();
  }
}

try {
  await start();
} catch (error) {
  showFault(shell.main, error);
  throw error;
}
