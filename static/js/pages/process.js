// What counts in a project: the kind of work it starts from, features switched on and off, features of one's own, levels.

import { all, get, patch, post, remove } from "../api.js";
import { fill, h, skeleton } from "../dom.js";
import { gathered, listen } from "../events.js";
import { icon } from "../icons.js";
import { boot, pageAddress, showFault } from "../shell.js";
import { complain, toast } from "../toasts.js";
import { plural } from "../words.js";

const LEVELS = [
  { value: "quantile", label: "Equally common", text: "Small, middle and large each hold a third of the values on your tools." },
  { value: "range", label: "Equally wide", text: "Small, middle and large each span a third of the range of values." },
];

const shell = await boot();
const parts = { head: h("div.head"), kinds: h("div.templates"), save: h("form.save-template", { novalidate: true }), features: h("div.switches"), own: h("div"), levels: h("div.switches"), count: h("span.push.small.muted") };
const state = { process: null, templates: [] };

async function change(changes, words) {
  const before = state.process;
  try {
    show(await patch(`/projects/${shell.projectId}/process`, changes, before.version));
    toast(words, { undo: () => put(before) });
  } catch (error) {
    complain(error);
    await load().catch(complain);
  }
}

// Undo of any change: what was switched before, and the interactions and levels that went with it.
async function put(before) {
  try {
    const off = before.features.filter((feature) => !feature.on).map((feature) => feature.key);
    const own = before.own.filter((feature) => feature.on && feature.file).map((feature) => feature.key);
    const template = before.template === state.process.template ? {} : { template: before.template };
    show(await patch(`/projects/${shell.projectId}/process`, { ...template, without: off, own, levels: before.levels, by_hand: before.by_hand, interactions: before.interactions.map(({ first, second }) => ({ first, second })) }, state.process.version));
  } catch (error) {
    complain(error);
  }
}

function paintHead() {
  const on = state.process.features.filter((feature) => feature.on).length + state.process.own.filter((feature) => feature.on).length;
  fill(parts.head, h("div.title", {}, h("h1", {}, "What counts in this project"), h("p", {}, "Start from your kind of work, then switch off what can’t matter.")),
    h("div.next", {}, h("p", {}, h("span.kicker", {}, `${plural(on, "feature")} count${on === 1 ? "s" : ""}`), "see what is shown of them"), h("a.btn.primary", { href: pageAddress(shell.projectId, "coverage") }, "Go on to coverage")));
}

function kind(template) {
  const inUse = template.id === state.process.template;
  const labels = new Map(state.process.features.map((feature) => [feature.key, feature.label.toLowerCase()]));
  const off = template.without.map((key) => labels.get(key)).filter(Boolean);
  const tools = template.built_in ? null : h("div.tools", {}, h("button.icon-btn", { type: "button", "aria-label": `Delete ${template.name}`, dataset: { key: `drop-${template.id}` }, onclick: () => drop(template) }, icon("trash")));
  return h("div", {}, h("button.kind", { type: "button", "aria-pressed": String(inUse), dataset: { key: `kind-${template.id}` }, onclick: () => !inUse && change({ template: template.id }, `Started from ${template.name}.`) },
    h("b.strong", {}, template.name), h("span.small.muted", {}, template.why || "Saved from a project."), h("span.small", {}, off.length ? `Without: ${off.join(", ")}` : "All features")), tools);
}

async function drop(template) {
  try {
    await remove(`/process-templates/${template.id}`);
    await load();
    toast(`${template.name} deleted. Projects that started from it keep their choice.`);
  } catch (error) {
    complain(error);
  }
}

function paintSave() {
  const name = h("input.field", { name: "template-name", maxlength: "120", placeholder: "Sanding, hall 2", autocomplete: "off" });
  const why = h("input.field", { name: "template-why", maxlength: "600", placeholder: "Why it is as it is, for whoever comes next", autocomplete: "off" });
  const fault = h("p.error-text", { role: "alert" });
  fill(parts.save, h("label", {}, "Keep this choice as a kind of work", name), why, h("div", {}, h("button.btn", { type: "submit" }, "Save")), fault);
  parts.save.onsubmit = async (event) => {
    event.preventDefault();
    if (!name.value.trim()) {
      fault.textContent = "A kind of work needs a name, such as “Sanding, hall 2”.";
      name.focus();
      return;
    }
    try {
      await post("/process-templates", { project_id: shell.projectId, name: name.value.trim(), why: why.value.trim() });
      toast(`${name.value.trim()} saved. Any project can start from it.`);
      await load();
      paintSave();
    } catch (error) {
      fault.textContent = error.message;
    }
  };
}

function toggle(feature) {
  const off = new Set(state.process.features.filter((other) => !other.on).map((other) => other.key));
  if (feature.on) off.add(feature.key);
  else off.delete(feature.key);
  return change({ without: [...off] }, `${feature.label} ${feature.on ? "no longer counts" : "counts again"}.`);
}

function paintFeatures() {
  const on = state.process.features.filter((feature) => feature.on).length;
  parts.count.textContent = `${on} of ${state.process.features.length} count`;
  fill(parts.features, state.process.features.map((feature) => h("label", { dataset: { tip: feature.symbol } },
    h("input", { type: "checkbox", checked: feature.on, dataset: { key: `feature-${feature.key}` }, onchange: () => toggle(feature) }), h("b.strong", {}, feature.label), h("span.small.muted", {}, feature.sentence))));
}

function toggleOwn(feature) {
  const keys = new Set(state.process.own.filter((other) => other.on && other.file).map((other) => other.key));
  if (feature.on) keys.delete(feature.key);
  else keys.add(feature.key);
  return change({ own: [...keys] }, `${feature.label} ${feature.on ? "no longer counts" : "counts now"}.`);
}

function ownFeature(feature) {
  const refused = feature.faults.length > 0;
  const note = refused ? h("span.error-text.small", {}, feature.faults.join(" ")) : h("span.small.muted", {}, feature.file ? `${feature.file}, version ${feature.version}` : `Version ${feature.version}: its file was changed or taken away since`);
  return h("label", {}, h("input", { type: "checkbox", checked: feature.on, disabled: refused || !feature.file, dataset: { key: `own-${feature.file}` }, onchange: () => toggleOwn(feature) }), h("b.strong", {}, feature.label ?? feature.file), note);
}

function paintOwn() {
  const { own, own_folder: folder } = state.process;
  fill(parts.own, own.length ? h("div.switches", {}, own.map(ownFeature)) : h("p.card-body.small.muted", {}, `Write a short Python file into the folder “${folder}” of the data folder, and it shows up here once it keeps to the rules. docs/features.md has one of ten lines.`));
}

function paintLevels() {
  fill(parts.levels, LEVELS.map((level) => h("label", {}, h("input", { type: "radio", name: "levels", checked: state.process.levels === level.value, dataset: { key: `levels-${level.value}` }, onchange: () => change({ levels: level.value }, `Levels are ${level.label.toLowerCase()} now.`) }), h("b.strong", {}, level.label), h("span.small.muted", {}, level.text))));
}

function show(process) {
  state.process = process;
  paintHead();
  fill(parts.kinds, state.templates.map(kind));
  paintFeatures();
  paintOwn();
  paintLevels();
}

async function load() {
  const [process, templates] = await Promise.all([get(`/projects/${shell.projectId}/process`), all("/process-templates")]);
  state.templates = templates;
  show(process);
}

async function start() {
  shell.crumb("What counts");
  fill(shell.main, parts.head, h("div.process", {},
    h("div", {}, h("section.card", {}, h("div.card-head", {}, h("h2", {}, "Kind of work")), parts.kinds, parts.save)),
    h("div", {}, h("section.card", {}, h("div.card-head", {}, h("h2", {}, "Features"), parts.count), parts.features),
      h("section.card", {}, h("div.card-head", {}, h("h2", {}, "Your own features"), h("button.btn.quiet.push", { type: "button", onclick: () => load().catch(complain) }, "Look again")), parts.own),
      h("section.card", {}, h("div.card-head", {}, h("h2", {}, "Small, middle, large"), h("span.push.small.muted", {}, "how coverage tells them apart")), parts.levels))));
  fill(parts.features, skeleton(6, "2.5rem"));
  const again = gathered(() => load().catch(complain), 200);
  for (const type of ["coverage.changed", "tool.changed", "resync"]) listen(type, again);
  await load();
  paintSave();
}

try {
  await start();
} catch (error) {
  showFault(shell.main, error);
  throw error;
}
