// Demonstrations: click the regions of a tool in order, in 3D, in the list or by letter; replay, save, keep the saved ones.
// The draft lives on the server: every action answers with the new draft, and clicks in the 3D view arrive as events.

import { all, get, post, put } from "../api.js";
import { fill, h } from "../dom.js";
import { gathered, listen } from "../events.js";
import { icon } from "../icons.js";
import { bind } from "../keys.js";
import { rampColour, sequenceStyle, tint } from "../ramp.js";
import { boot, pageAddress, query, remember, showFault } from "../shell.js";
import { complain, toast } from "../toasts.js";
import { View3D } from "../view3d.js";
import { plural } from "../words.js";
import { Author, standingWords } from "./record-author.js";
import { SavedList } from "./record-saved.js";
import { letterKeys } from "./region-letters.js";
import { reorderable } from "./reorder.js";

const SPEEDS = [1, 2, 4, 0.5];
const STEP_MS = 700;

const shell = await boot();
const state = { tool: null, regions: [], draft: null, tools: [], view: null, tab: "order", replay: null, speed: 1, saved: null, busy: false };
const parts = layout();

function iconButton(name, words, tip, run) {
  return h("button.icon-btn", { type: "button", "aria-label": words, dataset: { tip, key: words }, onclick: run }, icon(name));
}

function layout() {
  const undo = iconButton("undo", "Undo", "Undo (Ctrl Z)", () => act("undo"));
  const redo = iconButton("redo", "Redo", "Redo (Ctrl Shift Z)", () => act("redo"));
  const back = iconButton("back", "Step back", "Step back (left arrow)", () => stepBy(-1));
  const play = iconButton("play", "Replay", "Replay (space)", togglePlay);
  const forward = iconButton("forward", "Step forward", "Step forward (right arrow)", () => stepBy(1));
  const speed = h("button.btn.quiet.small", { type: "button", dataset: { tip: "Replay speed" }, "aria-label": "Replay speed 1x", onclick: changeSpeed }, "1x");
  const clear = h("button.btn.quiet.small", { type: "button", onclick: clearAll }, "Clear");
  const split = () => h("span.split", { role: "presentation", style: { display: "block", flex: "none" } });
  const hint = h("span.hint");
  const bar = h("div.bc.toolbar", { role: "toolbar", "aria-label": "Recording" }, undo, redo, split(), back, play, forward, speed, split(), clear);
  const stage = h("section.stage", { "aria-label": "3D view" }, h("div.tl", {}, hint), bar);
  const say = h("p.visually-hidden", { role: "status" });
  const tabs = h("div.segmented", { role: "group", "aria-label": "What the panel shows" });
  const count = h("span.push.small.muted.num");
  const panel = h("div.fill", { style: { flex: "1" } });
  const aside = h("aside.card.fill", { "aria-label": "Sequence" }, say, h("div.card-head", {}, tabs, count), panel);
  const head = h("div.head");
  const list = h("ol.seq-list");
  const left = h("div.left-list");
  const gain = h("div.hintbar");
  const author = new Author({ onChange: () => Promise.resolve(paint()).then(reload).catch(complain) });
  return { undo, redo, back, play, forward, speed, clear, hint, stage, say, tabs, count, panel, aside, head, list, left, gain, author, body: h("div.split", {}, stage, aside) };
}

const region = (id) => state.regions[id] ?? { name: String(id), description: "" };
const rest = () => state.regions.filter((entry) => !state.draft.sequence.includes(entry.id));

// ---- actions ---------------------------------------------------------------------------------------------------------------

async function change(request, words = null) {
  if (!state.draft) return;
  stopReplay();
  try {
    take(await request());
    if (words) parts.say.textContent = words();
  } catch (error) {
    complain(error);
    reload();
  }
}

function take(draft) {
  state.draft = draft;
  paint();
}

const draftOf = (id) => `/tools/${encodeURIComponent(id)}/draft${parts.author.name ? `?author=${encodeURIComponent(parts.author.name)}` : ""}`;
const address = (action = "") => `/tools/${encodeURIComponent(state.tool.id)}/draft${action}`;

function pick(id) {
  if (state.draft.sequence.includes(id)) return change(async () => state.draft, () => `${region(id).name} is number ${state.draft.sequence.indexOf(id) + 1} already`);
  return change(() => post(address("/pick"), { region: id }), () => `${region(id).name} is number ${state.draft.sequence.length} of ${state.regions.length}`);
}

function act(action) {
  if (action === "undo" ? !state.draft?.can_undo : !state.draft?.can_redo) return;
  change(() => post(address(`/${action}`)), () => (action === "undo" ? "Undone" : "Done again"));
}

function clearAll() {
  if (!state.draft.sequence.length) return;
  change(() => post(address("/clear")), () => "Cleared");
  toast("Order cleared", { undo: () => change(() => post(address("/undo"))) });
}

async function move(from, to) {
  const order = [...state.draft.sequence];
  if (from < 0 || to < 0 || to >= order.length || from === to) return;
  order.splice(to, 0, order.splice(from, 1)[0]);
  await change(() => put(address(), { sequence: order }), () => `${region(order[to]).name} is now number ${to + 1}`);
  parts.list.children[to]?.focus();
}

async function save() {
  if (!state.draft?.complete || state.busy) return;
  state.busy = true;
  const gained = state.draft.coverage_gain;
  try {
    const demonstration = await post(address("/save"), parts.author.name ? { author: parts.author.name } : {});
    toast(`${demonstration.name} saved${gained ? `: coverage went from ${gained.before.toFixed(2)} to ${gained.after.toFixed(2)}` : ""}`);
    await Promise.all([loadTools(), reload(), state.saved.load()]);
  } catch (error) {
    complain(error);
  }
  state.busy = false;
  paint();
}

// ---- replay: the draft, or a saved demonstration, step by step in the 3D view -------------------------------------------------

function startReplay(sequence, title, step = 0) {
  clearInterval(state.replay?.timer);
  state.replay = { sequence, title, step, timer: null };
  paint();
}

function stopReplay() {
  if (!state.replay) return;
  clearInterval(state.replay.timer);
  state.replay = null;
  paint();
}

function goTo(step) {
  const replay = state.replay;
  replay.step = Math.max(0, Math.min(replay.sequence.length, step));
  if (replay.step === replay.sequence.length) pause();
  paint();
}

function pause() {
  clearInterval(state.replay?.timer);
  if (state.replay) state.replay.timer = null;
}

function stepBy(by) {
  if (!state.draft) return;
  const sequence = state.replay?.sequence ?? state.draft.sequence;
  if (!sequence.length) return;
  if (!state.replay) startReplay([...sequence], null, sequence.length);
  pause();
  goTo(state.replay.step + by);
}

function togglePlay() {
  if (state.replay?.timer) {
    pause();
    return paint();
  }
  if (!state.replay) {
    if (!state.draft?.sequence.length) return undefined;
    startReplay([...state.draft.sequence], null);
  }
  if (state.replay.step >= state.replay.sequence.length) state.replay.step = 0;
  run();
  return paint();
}

function run() {
  clearInterval(state.replay.timer);
  state.replay.timer = setInterval(() => goTo(state.replay.step + 1), STEP_MS / state.speed);
}

function changeSpeed() {
  state.speed = SPEEDS[(SPEEDS.indexOf(state.speed) + 1) % SPEEDS.length];
  parts.speed.textContent = `${state.speed}x`;
  parts.speed.setAttribute("aria-label", `Replay speed ${state.speed}x`);
  if (state.replay?.timer) run();
}

function replaySaved(demonstration) {
  startReplay(demonstration.sequence, demonstration.name);
  run();
  paint();
}

// ---- painting ----------------------------------------------------------------------------------------------------------------

function paint() {
  if (!state.draft) return;
  paintHead();
  paintTabs();
  paintList();
  paintTools();
  paintView();
}

function nextWords() {
  const open = rest().length;
  const n = state.regions.length;
  if (state.replay?.title) return ["Replaying", state.replay.title];
  if (state.draft.complete) return ["Next: save it", `All ${n} regions have a number`];
  return [`Next: click region ${n - open + 1} of ${n}`, open === 1 ? "1 region is left" : `${open} regions are left`];
}

function paintHead() {
  const { tool, draft } = state;
  const [kicker, words] = nextWords();
  const why = draft.complete ? null : `Can be saved once all ${state.regions.length} regions have a number`;
  const button = state.replay?.title
    ? h("button.btn", { type: "button", dataset: { key: "save" }, onclick: stopReplay }, "Back to recording")
    : h(`button.btn${draft.complete ? ".primary" : ""}`, { type: "button", dataset: { key: "save", tip: why ?? "Save (Ctrl S)" }, "aria-disabled": draft.complete ? "false" : "true", onclick: save }, "Save demonstration");
  fill(parts.head, h("div.title", {}, h("h1", {}, `Show how you work ${tool.name}`), h("p", {}, standingWords(parts.author.split(tool)))),
    h("div.next", {}, h("p", {}, h("span.kicker", {}, kicker), h("span", {}, words)), button));
}

function paintTabs() {
  const tab = (key, words) => h("button", { type: "button", "aria-pressed": String(state.tab === key), dataset: { key: `tab-${key}` }, onclick: () => {
    state.tab = key;
    paint();
  } }, words);
  fill(parts.tabs, tab("order", "Your order"), tab("saved", `Saved${state.saved?.count ? ` (${state.saved.count})` : ""}`));
  parts.count.textContent = state.tab === "order" ? `${state.draft.sequence.length} of ${state.regions.length}` : "";
  if (parts.panel.dataset.tab === state.tab) return;
  parts.panel.dataset.tab = state.tab;
  if (state.tab === "order") fill(parts.panel, h("div.scroll", {}, parts.list), h("div.left", {}, h("h3", {}, "Not done yet"), parts.left), parts.author.node, parts.gain);
  else fill(parts.panel, h("div.scroll", {}, state.saved.node));
}

function row(id, index) {
  const { draft, replay } = state;
  const times = draft.click_times ?? [];
  const waited = index ? times[index] - times[index - 1] : NaN;
  const gap = waited > 0 ? `+${waited.toFixed(1)} s` : ""; // a row that was moved says nothing about time
  const current = replay && !replay.title ? replay.step - 1 : draft.sequence.length - 1;
  const ahead = replay && !replay.title && index >= replay.step;
  return h(`li${ahead ? ".ahead" : ""}`, { draggable: "true", tabindex: "0", "aria-current": index === current ? "step" : null, dataset: { key: `row-${id}` }, "aria-label": `${index + 1}: ${region(id).name}, ${region(id).description}. Alt with arrows moves it` },
    h("span.grip", { "aria-hidden": "true" }, icon("grip")), h("span.seq-no", { style: sequenceStyle(index, state.regions.length) }, index + 1),
    h("span.letter", {}, region(id).name), h("span.name", {}, region(id).description), h("span.time", {}, gap));
}

function paintList() {
  const { draft } = state;
  fill(parts.list, draft.sequence.length ? draft.sequence.map(row) : h("p.empty-words", {}, "Nothing yet. Click the region you would start with, in the 3D view or below."));
  if (!parts.list.contains(document.activeElement)) parts.list.lastElementChild?.scrollIntoView({ block: "nearest" });
  const open = rest();
  fill(parts.left, open.length ? open.map((entry) => h("button", { type: "button", dataset: { key: `left-${entry.id}`, tip: entry.description }, "aria-label": `${entry.name}, ${entry.description}`, onclick: () => pick(entry.id) },
    h("span.swatch.pastel", { style: { "--swatch": tint(entry.id) } }), entry.name)) : h("span.small.muted", {}, "Every region has its number."));
  paintGain();
}

// What saving would bring, or an order begun on regions that have changed since.
function paintGain() {
  const { older, coverage_gain: gain } = state.draft;
  parts.gain.hidden = !older && !gain?.text;
  parts.gain.classList.toggle("older", Boolean(older));
  if (older) {
    const words = `${plural(older.placed, "region")} had a number on an older cut of this tool.`;
    fill(parts.gain, icon("history"), h("p", {}, older.can_carry_over ? words : `${words} ${older.why}`), older.can_carry_over ? h("button.btn.small", { type: "button", dataset: { key: "carry-draft" }, onclick: () => change(() => post(address("/carry-over")), () => "Carried over") }, "Carry over") : null);
  } else if (gain?.text) fill(parts.gain, icon("rise"), h("p", {}, gain.text));
}

function paintTools() {
  const { draft, replay } = state;
  parts.undo.disabled = !draft.can_undo;
  parts.redo.disabled = !draft.can_redo;
  parts.clear.disabled = !draft.sequence.length;
  const none = !(replay?.sequence ?? draft.sequence).length;
  for (const button of [parts.back, parts.play, parts.forward]) button.disabled = none;
  parts.play.replaceChildren(icon(replay?.timer ? "pause" : "play"));
  parts.play.setAttribute("aria-label", replay?.timer ? "Pause" : "Replay");
  const names = state.regions.map((entry) => entry.name);
  fill(parts.hint, replay ? h("span.plate", {}, `${replay.title ?? "Your order"}: ${replay.step ? `after step ${replay.step} of ${replay.sequence.length}` : "before the start"}`) : [h("kbd", {}, names[0]), " to ", h("kbd", {}, names.at(-1)), " pick a region by letter"]);
}

function paintView() {
  const { tool, draft, replay } = state;
  if (replay) return state.view.show({ mode: "sequence", tool_id: tool.id, sequence: replay.sequence, step: replay.step }, `${tool.name} after step ${replay.step} of ${replay.sequence.length}`);
  return state.view.show({ mode: "record", tool_id: tool.id }, `3D view of ${tool.name}: ${draft.sequence.length} of ${state.regions.length} regions are numbered`);
}

// ---- reading -----------------------------------------------------------------------------------------------------------------

async function reload() {
  const id = state.tool.id;
  const draft = await get(draftOf(id));
  if (state.tool.id === id) take(draft);
}

async function loadTools() {
  state.tools = (await all(`/projects/${shell.projectId}/tools`)).filter((tool) => tool.state === "ready");
  if (state.tool) state.tool = state.tools.find((tool) => tool.id === state.tool.id) ?? state.tool;
  drawCrumb();
}

function drawCrumb() {
  shell.crumb(state.tool?.name ?? "Demonstrations", () => state.tools.map((tool) => ({ label: tool.name, note: tool.demonstrated ? "recorded" : "", current: tool.id === state.tool?.id, run: () => open(tool.id).catch(complain) })));
}

async function open(id) {
  pause();
  state.replay = null;
  state.tool = state.tools.find((tool) => tool.id === id) ?? (await get(`/tools/${encodeURIComponent(id)}`));
  remember("tool", state.tool.id);
  drawCrumb();
  const [regions, draft] = await Promise.all([all(`/tools/${encodeURIComponent(id)}/regions`), get(draftOf(id))]);
  state.regions = regions.sort((a, b) => a.id - b.id);
  take(draft);
}

function showEmpty() {
  fill(shell.main, h("div.head", {}, h("div.title", {}, h("h1", {}, "Demonstrations"), h("p", {}, "Show the order in which you work a tool."))),
    h("div.empty", {}, h("h2", {}, "No tool is ready yet"), h("p", {}, "A demonstration needs a tool cut into regions. Upload one, or import a region table."), h("a.btn.primary", { href: pageAddress(shell.projectId, "tools") }, "Go to the tools")));
}

async function start() {
  await loadTools();
  const wanted = query("tool") ?? shell.project.next_step.tool_id;
  const tool = state.tools.find((entry) => entry.id === wanted) ?? state.tools.find((entry) => !entry.demonstrated) ?? state.tools[0];
  if (!tool) return showEmpty();
  fill(shell.main, parts.head, parts.body);
  state.view = new View3D(parts.stage, { projectId: shell.projectId, name: "record" });
  state.saved = new SavedList({ projectId: shell.projectId, onReplay: (demonstration) => showSaved(demonstration).catch(complain), onAgain: (demonstration) => recordAgain(demonstration).catch(complain), onChange: () => {
    parts.author.offer(state.saved.authors);
    paint();
  } });
  await Promise.all([open(tool.id).then(bindAll), state.saved.load()]); // whoever sees the regions may press their letters at once
  paint();
  return undefined;
}

async function showSaved(demonstration) {
  if (demonstration.tool_id !== state.tool.id) await open(demonstration.tool_id);
  replaySaved(demonstration);
}

async function recordAgain(demonstration) {
  await open(demonstration.tool_id);
  state.tab = "order";
  paint();
  toast(`Record ${state.tool.name} again. Until you save, the older order stays.`);
}

function bindAll() {
  reorderable(parts.list, move);
  letterKeys({ regions: () => state.regions, pick });
  bind({ key: "z", ctrl: true, shift: false, name: "Undo", run: () => act("undo") });
  bind({ key: "z", ctrl: true, shift: true, name: "Redo", shown: "Ctrl Shift Z", run: () => act("redo") });
  bind({ key: "s", ctrl: true, name: "Save the demonstration", run: save });
  bind({ key: " ", shown: "Space", name: "Replay or pause", run: togglePlay });
  bind({ key: "ArrowLeft", shown: "←", name: "Step back", run: () => stepBy(-1) });
  bind({ key: "ArrowRight", shown: "→", name: "Step forward", run: () => stepBy(1) });
  bind({ key: "Escape", name: "Leave the replay", when: () => state.replay !== null, run: stopReplay });
  bind({ key: () => false, shown: "Alt ↑ or ↓", name: "Move the focused row of the list", run: () => {} });
  const freshDraft = gathered(() => reload().catch(complain), 30);
  const freshTools = gathered(() => Promise.all([loadTools(), state.saved.load()]).then(paint).catch(complain), 200);
  listen("draft.changed", ({ tool_id: id }) => id === state.tool.id && freshDraft());
  listen("demonstration.changed", freshTools);
  listen("tool.changed", freshTools);
  listen("resync", () => {
    freshDraft();
    freshTools();
  });
  addEventListener("themechange", paint);
}

try {
  await start();
} catch (error) {
  showFault(shell.main, error);
  throw error;
}
