// Teach: start a run, watch it learn, answer its questions, see how it ended. The run and its questions live on the server, so
// this page can be closed at any time and shows the same question again tomorrow.

import { all, get, post } from "../api.js";
import { fill, h } from "../dom.js";
import { gathered, listen } from "../events.js";
import { boot, pageAddress, showFault } from "../shell.js";
import { complain, toast } from "../toasts.js";
import { ago, number, plural } from "../words.js";
import { Notes } from "./teach-notes.js";
import { QuestionView } from "./teach-question.js";
import { outcomeCard, startCards } from "./teach-start.js";
import { Training } from "./teach-training.js";

const ACTIVE = ["waiting_for_expert", "training", "queued", "cancelling"];
const KIND_WORDS = { performance: "what makes an order good", effort: "which good order is less effort", exception: "the order you want on one tool" };
const HISTORY_WORDS = { performance: "What makes an order good", effort: "Which one is less effort", exception: "An order for one tool" };
const STATE_WORDS = { queued: "about to start", training: "learning", waiting_for_expert: "waiting for you", converged: "learned", stalled: "nothing left to ask", infeasible: "contradictions", failed: "stopped with an error", cancelling: "stopping", cancelled: "stopped" };

const shell = await boot();
const state = { runs: [], run: null, queries: [], answers: [], regions: new Map(), mode: "" };
const training = new Training({ onCancel: () => runAction("cancel").catch(complain) });
const question = new QuestionView({ projectId: shell.projectId, regionsOf: (tool) => state.regions.get(tool) ?? [], onAnswer: answer, onUndo: () => undo().catch(complain), canUndo: () => state.answers.length > 0, onFile: fileRead });
const notes = new Notes({ projectId: shell.projectId, report: question.file.report });

// ---- actions -----------------------------------------------------------------------------------------------------------------

async function runAction(action) {
  await post(`/runs/${encodeURIComponent(state.run.id)}/${action}`);
  await load();
}

async function answer(query, choice) {
  try {
    const given = await post(`/queries/${encodeURIComponent(query.id)}/answer`, { value: choice.value });
    state.answers.push(given);
    toast(choice.value === "both_wrong" ? `Then show us your order for ${query.tool_name}` : `Answered: ${choice.label}`, { undo: () => undo(given) });
  } catch (error) {
    complain(error);
  }
  await load().catch(complain);
}

async function undo(given = state.answers.at(-1)) {
  if (!given) return;
  await post(`/answers/${encodeURIComponent(given.id)}/undo`);
  state.answers = state.answers.filter((entry) => entry.id !== given.id);
  await load();
  toast("Answer taken back: the question is open again");
}

// One answer alone: the question opens again, what was answered later stays.
async function takeBack(entry) {
  await post(`/answers/${encodeURIComponent(entry.answer_id)}/undo?keep_later=true`);
  state.answers = state.answers.filter((other) => other.id !== entry.answer_id);
  await load();
  toast(`Answer taken back: the question about ${entry.tool_name} is open again`);
}

async function fileRead(report) {
  state.answers.push(...report.applied);
  await load();
}

function started(run) {
  state.answers = [];
  state.run = run;
  load().catch(complain);
}

// ---- reading -----------------------------------------------------------------------------------------------------------------

function currentRun(runs) {
  return ACTIVE.map((wanted) => runs.find((run) => run.state === wanted)).find(Boolean) ?? runs[0] ?? null;
}

async function readRegions(tools) {
  const missing = [...new Set(tools)].filter((tool) => !state.regions.has(tool));
  await Promise.all(missing.map(async (tool) => state.regions.set(tool, (await all(`/tools/${encodeURIComponent(tool)}/regions`)).sort((a, b) => a.id - b.id))));
}

// Answers given earlier, perhaps in another browser: the last one can still be taken back.
async function readAnswers(run) {
  if (state.answers.length || !run.answered) return;
  const past = await all(`/runs/${encodeURIComponent(run.id)}/queries?state=answered`);
  state.answers = past.map((query) => query.answer).filter(Boolean).sort((a, b) => a.created_at.localeCompare(b.created_at));
}

let reading = 0;

async function load() {
  const mine = (reading += 1);
  const runs = (await all(`/projects/${encodeURIComponent(shell.projectId)}/runs`)).sort((a, b) => b.created_at.localeCompare(a.created_at));
  const run = currentRun(runs);
  const queries = run?.state === "waiting_for_expert" ? (await all(`/runs/${encodeURIComponent(run.id)}/queries?state=open`)).sort((a, b) => a.number - b.number) : [];
  if (run) await readAnswers(run);
  await readRegions(queries.map((query) => query.tool_id));
  if (mine !== reading) return;
  Object.assign(state, { runs, run, queries });
  await draw();
}

async function refreshRun() {
  if (!state.run) return load();
  const run = await get(`/runs/${encodeURIComponent(state.run.id)}`);
  if (run.state !== state.run.state || run.open_queries !== state.run.open_queries) return load();
  state.run = run;
  training.show(run, { tall: state.mode === "training" });
  if (state.mode === "training") drawTrainingHead();
  return training.load();
}

// ---- painting ----------------------------------------------------------------------------------------------------------------

function modeOf(run, queries) {
  if (!run) return "start";
  if (run.state === "waiting_for_expert") return queries.length ? "question" : "training";
  return ["queued", "training", "cancelling"].includes(run.state) ? "training" : "ended";
}

async function draw() {
  const { run, queries } = state;
  const mode = modeOf(run, queries);
  if (mode !== "question") question.hide();
  if (mode === "start") return drawStart();
  training.show(run, { tall: mode === "training" });
  notes.show(run);
  if (mode === "question") {
    question.show(queries[0]);
    if (state.mode !== mode || !question.pair.isConnected) fill(shell.main, notes.node, question.nodes, training.node);
  } else if (mode === "training") {
    if (state.mode !== mode) fill(shell.main, trainingHead, notes.node, training.node, h("p.small.muted", {}, "You can close this page: learning goes on, and questions wait for you."));
    drawTrainingHead();
  } else await drawEnded();
  if (state.mode === "training" && mode === "question") training.node.open = false;
  state.mode = mode;
  return training.load();
}

const trainingHead = h("div.head");

function drawTrainingHead() {
  const { run } = state;
  const words = run.message || STATE_WORDS[run.state];
  fill(trainingHead, h("div.title", {}, h("h1", {}, `Learning ${KIND_WORDS[run.kind]}`), h("p", { role: "status" }, words)),
    h("div.next.calm", {}, h("p", {}, run.loss === null ? "" : h("span.num", {}, run.mode === "certified" ? `step ${run.iteration}` : `step ${run.iteration}, loss ${number(run.loss)}`))));
}

function head(words) {
  return h("div.head", {}, h("div.title", {}, h("h1", {}, "Teach"), h("p", {}, words)));
}

async function drawStart() {
  if (state.mode === "start" && shell.main.querySelector(".kinds")) return;
  state.mode = "start";
  const cards = await startCards({ project: shell.project, runs: state.runs, onStarted: started });
  fill(shell.main, head("Let it learn from your demonstrations, then answer what it is not sure about."), cards);
}

async function drawEnded() {
  const { run } = state;
  const cards = await startCards({ project: shell.project, runs: state.runs, onStarted: started });
  const tools = run.state === "infeasible" ? await all(`/projects/${encodeURIComponent(shell.projectId)}/tools`) : [];
  if (run.state === "converged" && run.kind === "performance") cards.querySelectorAll(".btn.primary").forEach((button) => button.classList.remove("primary"));
  else if (["stalled", "failed", "cancelled", "converged", "infeasible"].includes(run.state)) cards.querySelectorAll(".btn.primary").forEach((button) => button.classList.remove("primary"));
  training.node.open = false;
  fill(shell.main, head(`The last run used ${plural(run.tools.length, "demonstration")}${run.authors.length ? ` of ${run.authors.join(" and ")}` : ""}.`), notes.node, outcomeCard({ run, project: shell.project, act: runAction, tools, takeBack: (entry) => takeBack(entry).catch(complain) }), cards, training.node, history());
}

function history() {
  if (state.runs.length < 2) return null;
  const row = (run) => h("tr", {}, h("td", {}, HISTORY_WORDS[run.kind]), h("td", {}, STATE_WORDS[run.state] ?? run.state), h("td.num", {}, plural(run.answered, "answer")), h("td.num.muted", {}, ago(run.created_at)),
    h("td", {}, run.policy_id ? h("a", { href: pageAddress(shell.projectId, "policy", { policy: run.policy_id }) }, "policy") : ""));
  return h("section.card", { style: { flex: "none" } }, h("div.card-head", {}, h("h2", {}, "All runs")), h("table.run-list", {}, h("thead", {}, h("tr", {}, h("th", {}, "Learned"), h("th", {}, "State"), h("th.num", {}, "Answers"), h("th.num", {}, "Started"), h("th", {}, ""))), h("tbody", {}, state.runs.map(row))));
}

// ---- start -------------------------------------------------------------------------------------------------------------------

try {
  const anew = gathered(() => load().catch(complain), 120);
  const tick = gathered(() => refreshRun().catch(complain), 600);
  listen("query.changed", anew);
  listen("run.changed", ({ run_id: id, state: now }) => (id === state.run?.id && now === state.run.state ? tick() : anew()));
  listen("job.progress", tick);
  listen("resync", anew);
  await load();
} catch (error) {
  showFault(shell.main, error);
  throw error;
}
