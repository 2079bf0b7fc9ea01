// All projects: the one thing to do next, the list with its progress, what runs right now.

import { all, get, patch, post, remove } from "../api.js";
import { fill, h } from "../dom.js";
import { connect, gathered, listen } from "../events.js";
import { icon } from "../icons.js";
import { bind } from "../keys.js";
import { menuButton } from "../menu.js";
import { STAGES, STAGE_WORDS, boot, drawRail, pageAddress, showFault, statusOf } from "../shell.js";
import { complain, toast } from "../toasts.js";
import { drawTool } from "../thumbnail.js";
import { View3D } from "../view3d.js";
import { ago, plural, sentence, spoken, timeLeft } from "../words.js";

const DELETE_AFTER_MS = 4200;
const PROCESSES = ["Composite layup", "Surface finishing", "Spraying"]; // each has a template; any other word starts from that of layup

const shell = await boot();
const head = h("div.head");
const form = h("div");
const hero = h("div");
const table = h("section.card");
const aside = h("aside.stack");
const body = h("div.project-grid", {}, table, aside);
fill(shell.main, head, form, hero, body);

let projects = null;
const leaving = new Set(); // deleted here, still within their time to be taken back
const pictures = new Map();
let view = null;
let heroFor = "";

function nextOf(project) {
  return { href: pageAddress(project.id, project.next_step.page, { tool: project.next_step.tool_id }), ...project.next_step };
}

function foremost(list) {
  return list.find((project) => project.counts.open_queries > 0) ?? list[0];
}

function drawHead(list) {
  const waiting = list.filter((project) => project.counts.open_queries > 0).length;
  const count = sentence(spoken(list.length, "project"));
  const words = list.length === 0 ? "Nothing here yet." : waiting === 0 ? `${count}.` : waiting === list.length && waiting === 1 ? "One project, and it is waiting for you." : `${count}, ${spoken(waiting, "is", "are").replace(/^(\w+) (\w+)$/, "$1 of them $2")} waiting for you.`;
  fill(head, h("div.title", {}, h("h1", {}, "Projects"), h("p", {}, words)),
    h("button.btn", { type: "button", style: { "margin-left": "auto" }, dataset: { key: "new" }, onclick: openForm }, icon("plus"), "New project"));
}

function openForm() {
  const name = h("input.field", { name: "name", required: true, maxlength: "80", placeholder: "Fairing layup", autocomplete: "off" });
  const process = h("input.field", { name: "process", maxlength: "80", placeholder: "Composite layup", list: "processes", autocomplete: "off" });
  const fault = h("p.error-text", { role: "alert" });
  const submit = async (event) => {
    event.preventDefault();
    if (!name.value.trim()) {
      name.setAttribute("aria-invalid", "true");
      fault.textContent = "A project needs a name, such as “Fairing layup”.";
      name.focus();
      return;
    }
    try {
      const project = await post("/projects", { name: name.value.trim(), process: process.value.trim() || "Composite layup" });
      location.href = pageAddress(project.id, "tools");
    } catch (error) {
      fault.textContent = error.message;
    }
  };
  fill(form, h("form.card.pad.stack", { onsubmit: submit, novalidate: true, "aria-label": "New project" },
    h("div.new-project", {}, h("label", {}, "Name", name), h("label", {}, "Kind of work", process),
      h("datalist#processes", {}, PROCESSES.map((value) => h("option", { value }))),
      h("button.btn", { type: "submit" }, "Create project"), h("button.btn.quiet", { type: "button", onclick: () => fill(form) }, "Cancel")), fault));
  form.addEventListener("keydown", (event) => event.key === "Escape" && fill(form), { once: true });
  name.focus();
}

async function openSample(event) {
  const button = event.currentTarget;
  button.disabled = true;
  try {
    const project = await post("/projects/sample");
    location.href = pageAddress(project.id, "tools");
  } catch (error) {
    button.disabled = false;
    complain(error);
  }
}

function drawHero(list) {
  const project = foremost(list);
  const key = project ? `${project.id}:${project.next_step.title}:${project.next_step.tool_id}` : "none";
  if (key === heroFor) return;
  heroFor = key;
  if (!project) {
    fill(hero, h("section.card.hero.alone", { "aria-label": "Your next step" }, h("div.text", {}, h("span.chip.signal", {}, "Start here"),
      h("h2", {}, "Try it on the sample project"),
      h("p", {}, "Ten tools, five of them already demonstrated: record one, answer a few questions, and watch the robot work a tool nobody has shown it."),
      h("div.actions", {}, h("button.btn.primary", { type: "button", onclick: openSample }, "Open the sample project")))));
    return;
  }
  const next = nextOf(project);
  const stage = h("div.stage");
  fill(hero, h("section.card.hero", { "aria-label": "Your next step", class: "card hero" }, h("div.text", {}, h("span.chip.signal", {}, `Next step in ${project.name}`),
    h("h2", {}, next.title), h("p", {}, next.text), h("div.actions", {}, h("a.btn.primary", { href: next.href }, next.label))), stage));
  hero.firstElementChild.classList.toggle("alone", !next.tool_id);
  if (next.tool_id) showHero(project, next, stage);
  else stage.remove();
}

async function showHero(project, next, stage) {
  view = new View3D(stage, { projectId: project.id, name: "hero" });
  const shown = (await all(`/projects/${project.id}/demonstrations`).catch(() => [])).find((entry) => entry.tool_id === next.tool_id && !entry.deleted && !entry.superseded_by);
  if (shown) view.show({ mode: "sequence", tool_id: next.tool_id, sequence: shown.sequence, step: null }, `${shown.tool_name} with the order of work from 1 to ${shown.sequence.length}`);
  else view.show({ mode: "tool", tool_id: next.tool_id }, "The tool of the next step, not worked yet");
}

function stations(project) {
  const words = project.stages.map((stage, index) => `${STAGES[index]?.name ?? stage.key} ${STAGE_WORDS[stage.state]}`).join(", ");
  return h("span.stations", { role: "img", "aria-label": words }, project.stages.map((stage, index) =>
    h("i", { dataset: { stage: stage.state, tip: `${STAGES[index]?.name ?? stage.key}: ${stage.meta || STAGE_WORDS[stage.state]}` } })));
}

function deleteSoon(project) {
  leaving.add(project.id);
  draw();
  const timer = setTimeout(async () => {
    try {
      await remove(`/projects/${project.id}`, project.version);
    } catch (error) {
      complain(error);
    }
    leaving.delete(project.id);
    load();
  }, DELETE_AFTER_MS);
  toast(`${project.name} deleted`, { undo: () => {
    clearTimeout(timer);
    leaving.delete(project.id);
    draw();
  } });
}

async function rename(project) {
  const cell = table.querySelector(`[data-project="${CSS.escape(String(project.id))}"]`);
  const { renameable } = await import("../rename.js");
  const field = renameable(project.name, "project", async (name) => {
    await patch(`/projects/${project.id}`, { name }, project.version);
    await load();
  });
  cell.replaceChildren(field);
  field.querySelector("button").click();
}

// One canvas per project, kept while the table is drawn anew: its first tool, coloured where somebody has demonstrated it.
function picture(project) {
  if (!pictures.has(project.id)) {
    const canvas = h("canvas.mini", { "aria-hidden": "true" });
    pictures.set(project.id, canvas);
    showPicture(project, canvas).catch(complain);
  }
  return pictures.get(project.id);
}

async function showPicture(project, canvas) {
  const tools = (await get(`/projects/${encodeURIComponent(project.id)}/tools`)).items.filter((tool) => tool.state === "ready");
  const tool = tools.find((entry) => entry.demonstrated) ?? tools[0];
  if (!tool) return;
  const shown = tool.demonstration_id ? await get(`/demonstrations/${encodeURIComponent(tool.demonstration_id)}`) : null;
  await drawTool(canvas, tool.id, { sequence: shown?.sequence });
}

function row(project) {
  const next = nextOf(project);
  const counts = `${plural(project.counts.tools, "tool")}, ${project.counts.demonstrations ? plural(project.counts.demonstrations, "demonstration") : "nothing recorded"}`;
  const status = statusOf(project);
  const nextCell = project.counts.open_queries ? h("span.chip.signal", {}, plural(project.counts.open_queries, "question")) : status.state === "running" ? status.text : next.title;
  return h("tr", {}, h("td.picture", {}, picture(project)), h("th", { scope: "row", class: "name" }, h("span", { dataset: { project: project.id } }, h("a", { href: next.href, dataset: { key: `open-${project.id}` } }, project.name)), h("br"), h("span.small.muted", {}, counts)),
    h("td", {}, stations(project)), h("td.muted", {}, nextCell), h("td.num.muted", {}, ago(project.updated_at)),
    h("td.row-actions", {}, menuButton("", () => [{ label: "Rename", run: () => rename(project) }, { label: "Delete", run: () => deleteSoon(project) }], "button.icon-btn", { name: `More about ${project.name}` })));
}

function drawTable(list) {
  table.hidden = list.length === 0;
  fill(table, h("table.projects", {}, h("thead", {}, h("tr", {}, h("th", {}, h("span.visually-hidden", {}, "Picture")), h("th", {}, "Project"), h("th", {}, "Progress"), h("th", {}, "Next"), h("th.num", {}, "Last change"), h("th", {}, h("span.visually-hidden", {}, "More")))),
    h("tbody", {}, list.map(row))));
}

function drawAside(list) {
  const running = list.flatMap((project) => project.running.map((job) => ({ ...job, project })));
  const lines = running.map((job) => h("div.progress-line", {}, h("span", {}, job.title), h("span.muted.num", {}, timeLeft(job.seconds_left) || job.message),
    h("div.progress", { role: "progressbar", "aria-label": job.title, "aria-valuenow": Math.round(job.fraction * 100), "aria-valuemin": 0, "aria-valuemax": 100, style: { "--value": `${Math.round(job.fraction * 100)}%` } }, h("i"))));
  const sample = list.some((project) => project.sample) ? null : h("p.small.muted", { style: { padding: "0 var(--s-4)" } }, "New here? The sample project has ten tools and takes five short steps. ", h("button.btn.quiet.small", { type: "button", onclick: openSample, style: { "margin-left": "calc(-1 * var(--s-3))" } }, "Open the sample project"));
  fill(aside, list.length ? h("section.card.pad.stack", { style: { gap: "var(--s-3)" } }, h("h2", { style: { "font-size": "var(--t-md)" } }, "Running now"), lines.length ? lines : h("p.small.muted", {}, "Nothing is running.")) : null, list.length ? sample : null);
}

function draw() {
  const list = projects.filter((project) => !leaving.has(project.id));
  if (!table.querySelector("input")) drawTable(list);
  drawHead(list);
  drawHero(list);
  drawAside(list);
  drawRail(list.length ? foremost(list) : null, "projects");
  document.querySelector(".topbar .push").replaceChildren();
  const project = list.length ? foremost(list) : null;
  if (project) {
    const { state, text, page } = statusOf(project);
    document.querySelector(".topbar .push").append(h(page ? "a.status" : "span.status", { dataset: { state }, href: page ? pageAddress(project.id, page) : null }, h("span.dot"), text));
  }
}

async function load() {
  projects = (await all("/projects")).sort((a, b) => b.updated_at.localeCompare(a.updated_at));
  draw();
}

try {
  await load();
  bind({ key: "n", name: "New project", run: openForm });
  connect(null);
  const again = gathered(() => load().catch(complain), 500);
  listen("*", (type) => !type.startsWith("session.") && type !== "scene.changed" && again());
  listen("resync", again);
} catch (error) {
  showFault(shell.main, error);
}
