// What the demonstrations show so far: rho, one 3 x 3 table per suspected interaction, and what to record next.

import { get, put } from "../api.js";
import { dial } from "../charts.js";
import { fill, h, skeleton } from "../dom.js";
import { gathered, listen } from "../events.js";
import { icon } from "../icons.js";
import { boot, pageAddress, showFault } from "../shell.js";
import { complain, toast } from "../toasts.js";
import { View3D } from "../view3d.js";
import { plural, sentence, spoken } from "../words.js";
import { Levels } from "./coverage-levels.js";

const GOAL = 0.9; // below it the page calls a policy a draft
const STATES = {
  captured: { look: "captured", icon: "check", word: "covered" },
  uneven: { look: "thin", icon: "half", word: "uneven" },
  missing: { look: "missing", icon: "ring", word: "missing" },
  impossible: { look: "none", icon: "minus", word: "on no tool" },
};

const shell = await boot();
const parts = {
  head: h("div.head"),
  dial: h("div.dial", { role: "meter", "aria-valuemin": "0", "aria-valuemax": "1", "aria-label": "Coverage" }),
  summary: h("div"),
  matrices: h("div.matrices"),
  requests: h("div.requests"),
  title: h("h2"),
  note: h("span.push.small.muted"),
  stage: h("div.stage.example", { "aria-label": "3D view" }),
  detail: h("div.situation"),
  suspect: h("details", { name: "coverage-more" }, h("summary", {}, "What do you think matters?")),
  suspectBody: h("div.suspect"),
};
const levels = new Levels({ projectId: shell.projectId, onReport: (report) => take(report) });
const state = { report: null, chosen: null, tool: 0, view: null };

const signed = (value) => `${value < 0 ? "−" : "+"}${Math.abs(value).toFixed(2)}`;

function cellName(table, i, j) {
  return `${table.row_words[i]} and ${table.column_words[j]}`;
}

function paintHead() {
  const first = state.report.requests.find((request) => request.useful);
  const { demonstrations, steps } = state.report;
  fill(parts.head, h("div.title", {}, h("h1", {}, "What the demonstrations show so far"),
    h("p", {}, `${sentence(spoken(demonstrations, "demonstration"))}, ${plural(steps, "step")}. A policy can only be trusted where it has seen examples.`)),
  first
    ? h("div.next", {}, h("p", {}, h("span.kicker", {}, `Next: record ${first.tool_name}`), first.gain > 0 ? `${signed(first.expected)} on average, ${signed(first.gain)} at best` : "it shows a new situation"), h("a.btn.primary", { href: pageAddress(shell.projectId, "record", { tool: first.tool_id }) }, "Record it"))
    : h("div.next", {}, h("p", {}, h("span.kicker", {}, "Next: teach"), "no tool here would add a situation"), h("a.btn.primary", { href: pageAddress(shell.projectId, "teach") }, "Go on to teach")));
}

function paintSummary() {
  const { rho, captured, shown, possible, rule } = state.report;
  dial(parts.dial, rho, GOAL);
  parts.dial.setAttribute("aria-valuenow", rho.toFixed(2));
  parts.dial.dataset.tip = `rho = captured / possible = ${captured} / ${possible}\nShown at all: ${shown} / ${possible}\nEq. 6. ${rule}`;
  fill(parts.summary, h("h2", {}, `${captured} of ${plural(possible, "possible situation")} ${captured === 1 ? "is" : "are"} covered`),
    h("p.muted.small", {}, `A situation counts when your demonstrations contain it and everything else about those steps is evenly spread. Below ${GOAL} a policy is a draft. Without the even spread, ${shown} of ${possible} are shown: ${(shown / Math.max(possible, 1)).toFixed(2)}.`));
}

function cell(table, t, i, j) {
  const entry = table.cells[i][j];
  const words = STATES[entry.state];
  const pressed = state.chosen && state.chosen.t === t && state.chosen.i === i && state.chosen.j === j;
  const proof = entry.p_value === null ? "" : `\nEven spread of the other features: p = ${entry.p_value.toFixed(3)} (covered above 0.05)`;
  return h("button.cell", { type: "button", dataset: { state: words.look, key: `cell-${t}-${i}-${j}`, tip: `${sentence(cellName(table, i, j))}: ${entry.count ? plural(entry.count, "step") : "no demonstration contains it"}${proof}` },
    "aria-pressed": String(Boolean(pressed)), "aria-label": `${cellName(table, i, j)}, ${words.word}, ${plural(entry.count, "step")}`, onclick: () => choose({ t, i, j }) },
  icon(words.icon), h("b", {}, entry.count || ""), h("small", {}, words.word));
}

function matrix(table, t) {
  const flat = table.cells.flat();
  const possible = flat.filter((entry) => entry.state !== "impossible");
  return h("section.card", {}, h("div.card-head", {}, h("h2", {}, sentence(table.label)), h("span.push.small.muted.num", {}, `${possible.filter((entry) => entry.state === "captured").length} of ${possible.length}`)),
    h("div.card-body", {}, h("div.matrix", { role: "group", "aria-label": table.label },
      table.cells.map((_, k) => table.cells.length - 1 - k).map((i) => [h("span.rowname", {}, table.row_words[i]), table.cells[i].map((_, j) => cell(table, t, i, j))]),
      h("span"), table.column_words.map((word) => h("span.col", {}, word)))),
    h("p.axes.small.muted", {}, `↑ ${table.row_title}   → ${table.column_title}`));
}

function requestRow(request, index) {
  const tip = request.useful ? `Change of rho by a demonstration of this tool, mean over a few orders; the best of them ${signed(request.gain)}` : "Nothing that is missing or uneven is on this tool";
  return h(`button${request.useful ? "" : ".quiet"}`, { type: "button", dataset: { key: `request-${request.tool_id}` }, "aria-pressed": String(state.chosen?.request === index), onclick: () => choose({ request: index }) },
    h("b.strong", {}, request.tool_name), h("span.gain", { dataset: { tip, sign: request.expected > 0 ? "up" : "none" } }, signed(request.expected)),
    h("span.small.muted", {}, request.useful && request.gain > request.expected ? `At best ${signed(request.gain)}. ${request.text}` : request.text));
}

function paintRequests() {
  const { requests } = state.report;
  fill(parts.requests, requests.some((request) => request.useful) ? null : h("p.empty-words.small", { style: { padding: "var(--s-3) var(--s-4)" } }, "Your tools show no further situation. New shapes would need a new tool."), requests.map(requestRow));
}

function shown() {
  const { chosen, report } = state;
  if (chosen?.request !== undefined) {
    const request = report.requests[chosen.request];
    return request && { title: request.tool_name, note: `${plural(request.regions.length, "region")} outlined`, tool_id: request.tool_id, tool_name: request.tool_name, regions: request.regions };
  }
  if (chosen) {
    const table = report.tables[chosen.t];
    const entry = table?.cells[chosen.i][chosen.j];
    if (!entry) return null;
    const tool = entry.tools[state.tool] ?? entry.tools[0];
    return { title: sentence(cellName(table, chosen.i, chosen.j)), note: STATES[entry.state].word, entry, tool_id: tool?.tool_id, tool_name: tool?.name, regions: tool?.regions ?? [] };
  }
  return null;
}

// What is known about the chosen situation: even or not, the tools that have it, what a new tool would need.
function paintSituation(example) {
  const entry = example?.entry;
  parts.detail.hidden = !entry;
  if (!entry) return;
  const proof = entry.p_value === null ? null : h("p.small", { dataset: { tip: "Chi-squared test, exact for small counts, corrected for the number of features" } }, h("span.num", {}, `p = ${entry.p_value.toFixed(3)}`), ` that steps this uneven come by chance; covered from 0.05. ${plural(entry.count, "step")} shown.`);
  const tools = entry.tools.map((tool, k) => h("button.chip", { type: "button", "aria-pressed": String(tool.tool_id === example.tool_id), dataset: { key: `has-${tool.tool_id}` }, onclick: () => { state.tool = k; paintExample(); } }, tool.name));
  const record = example.tool_id && entry.request ? h("a.btn.small", { href: pageAddress(shell.projectId, "record", { tool: example.tool_id }) }, `Record ${example.tool_name}`) : null;
  fill(parts.detail, entry.request ? h("p.small", {}, entry.request) : null, proof, tools.length ? h("div.has", {}, h("span.small.muted", {}, "On"), tools, record) : h("p.small", {}, "None of your tools has it."), entry.need ? h("p.small.muted", {}, entry.need) : null);
}

function paintExample() {
  const example = shown();
  paintSituation(example);
  parts.title.textContent = example?.title ?? "Choose a situation";
  parts.note.textContent = example?.note ?? "";
  if (!example?.tool_id) return state.view.show({ mode: "empty", tool_id: null }, "Nothing to show: no tool has this situation");
  return state.view.show({ mode: "tool", tool_id: example.tool_id, highlight: example.regions }, `${example.tool_name}, ${plural(example.regions.length, "region")} outlined`);
}

function paintSuspects() {
  const { interactions, interaction_choices: choices } = shell.project;
  const on = (entry) => interactions.some((other) => other.first === entry.first && other.second === entry.second);
  fill(parts.suspectBody, h("p.small.muted", {}, "Tick two things that you think act together when you choose the next region. ", h("a", { href: pageAddress(shell.projectId, "process") }, "Which features count at all?")),
    choices.map((entry) => h("label.check", {}, h("input", { type: "checkbox", checked: on(entry), dataset: { key: `suspect-${entry.first}-${entry.second}` }, onchange: (event) => suspect(entry, event.target.checked) }), sentence(entry.label))));
}

async function suspect(entry, wanted) {
  const before = shell.project.interactions;
  const after = wanted ? [...before, entry] : before.filter((other) => other.first !== entry.first || other.second !== entry.second);
  const send = (list) => put(`/projects/${shell.projectId}/interactions`, { interactions: list.map(({ first, second }) => ({ first, second })) });
  try {
    shell.show(await send(after));
    await load();
    toast(wanted ? `Now watching ${entry.label}.` : `No longer watching ${entry.label}.`, { undo: async () => {
      shell.show(await send(before));
      await load();
    } });
  } catch (error) {
    complain(error);
    paintSuspects();
  }
}

function choose(chosen) {
  state.chosen = chosen;
  state.tool = 0;
  paint();
}

function paint() {
  paintHead();
  paintSummary();
  fill(parts.matrices, state.report.tables.length ? state.report.tables.map(matrix) : h("div.empty", {}, h("h2", {}, "Nothing is suspected to act together"), h("p", {}, "Tick at least one pair under “What do you think matters?”.")));
  paintRequests();
  paintSuspects();
  levels.show(state.report.thresholds);
  paintExample();
}

async function load() {
  take(await get(`/projects/${shell.projectId}/coverage`));
}

function take(report) {
  state.report = report;
  if (!state.chosen && state.report.requests.length) state.chosen = { request: 0 };
  if (state.chosen && !shown()) state.chosen = null;
  paint();
}

async function start() {
  parts.suspect.append(parts.suspectBody);
  fill(shell.main, parts.head, h("div.coverage", {},
    h("div.main", {}, h("section.card.summary", {}, parts.dial, parts.summary), parts.matrices,
      h("div.legend", {}, Object.values(STATES).map((entry) => h("span", {}, icon(entry.icon), entry.word === "uneven" ? "seen, but unevenly" : entry.word === "on no tool" ? "on none of your tools" : entry.word)))),
    h("aside.card.fill", {}, h("div.card-head", {}, h("h2", {}, "Record this next"), h("span.push.small.muted", {}, "gain in coverage")), parts.requests, parts.suspect, levels.node,
      h("div.card-head", { style: { "border-top": "var(--hair) solid var(--line)" } }, parts.title, parts.note), parts.detail, parts.stage)));
  fill(parts.matrices, skeleton(4, "3rem"));
  state.view = new View3D(parts.stage, { projectId: shell.projectId, name: "coverage" });
  const again = gathered(() => load().catch(complain), 200);
  for (const type of ["coverage.changed", "demonstration.changed", "tool.changed", "resync"]) listen(type, again);
  await load();
}

try {
  await start();
} catch (error) {
  showFault(shell.main, error);
  throw error;
}
