// The lowest-cost order for any tool: the proof, the ties, what every step costs and why, and "what if" by moving a region.

import { all, get, post } from "../api.js";
import { stackedBars } from "../charts.js";
import { fill, h, skeleton } from "../dom.js";
import { gathered, listen } from "../events.js";
import { icon } from "../icons.js";
import { sequenceStyle } from "../ramp.js";
import { boot, pageAddress, query, remember, showFault } from "../shell.js";
import { Stepper } from "../stepper.js";
import { complain } from "../toasts.js";
import { View3D } from "../view3d.js";
import { Wishes } from "../wishes.js";
import { number, plural } from "../words.js";
import { Certificate } from "./policy-certificate.js";
import { Doubt, wantedWords } from "./policy-doubt.js";

const CAUSES = 5; // named in the chart; the rest is one grey bar

const shell = await boot();
const parts = {
  head: h("div.head"),
  stage: h("section.stage", { "aria-label": "3D view" }),
  proof: h("div.proof"),
  facts: h("dl.facts"),
  whatif: h("div.whatif", { "aria-live": "polite" }),
  legend: h("div.legend"),
  chart: h("div.chart"),
  tiles: h("div.tiles", { role: "group", "aria-label": "Order; move a region with Alt and the arrows to see what it would cost" }),
};
const wishes = new Wishes({ onChange: plan });
const names = new Map();
const certificate = new Certificate({ projectId: shell.projectId, names, onCompare: (tool, sequence) => compare(tool, sequence).catch(complain) });
const doubt = new Doubt({ projectId: shell.projectId, onDropped: () => plan(null) });
const state = { policies: [], policy: null, tools: [], tool: null, plan: null, order: [], recorded: false, whatif: null, view: null, stepper: null, chart: null };

// ---- chart --------------------------------------------------------------------------------------------------------------------

function causes() {
  const { features, steps } = state.plan;
  const size = features.map((_, k) => steps.reduce((sum, step) => sum + Math.abs(step.parts[k]), 0));
  const ranked = size.map((value, k) => [value, k]).filter(([value]) => value > 1e-9).sort((a, b) => b[0] - a[0]).map(([, k]) => k);
  const named = ranked.slice(0, ranked.length === CAUSES + 1 ? CAUSES + 1 : CAUSES);
  const rest = ranked.slice(named.length);
  const keys = named.map((k, i) => ({ columns: [k], label: features[k].label, symbol: features[k].symbol, colour: i < CAUSES ? `var(--c-${i + 1})` : "var(--c-rest)" }));
  if (rest.length) keys.push({ columns: rest, label: plural(rest.length, "other"), symbol: rest.map((k) => features[k].symbol).join(", "), colour: "var(--c-rest)" });
  return keys;
}

function paintLegend(keys) {
  fill(parts.legend, keys.map((key, k) => h("button", { type: "button", dataset: { key: `cause-${k}`, tip: `${key.label} (${key.symbol})` }, onpointerenter: () => state.chart.only(k), onpointerleave: () => state.chart.only(null), onfocus: () => state.chart.only(k), onblur: () => state.chart.only(null) },
    h("span.swatch", { style: { "--swatch": key.colour } }), key.label)));
}

function paintChart() {
  const keys = causes();
  paintLegend(keys);
  const columns = state.plan.steps.map((step, i) => ({ title: `Step ${i + 1}, ${step.name}`, parts: keys.map((key) => key.columns.reduce((sum, k) => sum + step.parts[k], 0)) }));
  state.chart = stackedBars(parts.chart, { keys, columns, description: `Cost per step of the order for ${state.tool.name}` });
}

// ---- what if --------------------------------------------------------------------------------------------------------------------

const changed = () => state.order.some((region, i) => region !== state.plan.sequence[i]);

async function move(from, to) {
  if (to < 0 || to >= state.order.length || from === to) return;
  const order = [...state.order];
  order.splice(to, 0, ...order.splice(from, 1));
  state.recorded = false;
  await tryOrder(order, () => parts.tiles.children[to]?.focus());
}

// A recorded order beside the cheapest one: in 3D, and through which features it costs more.
async function compare(toolId, sequence) {
  const tool = state.tools.find((entry) => entry.id === toolId);
  if (!tool) throw new Error("This tool is no longer in the project.");
  await open(tool);
  if ([...sequence].sort().join() !== [...state.plan.sequence].sort().join()) throw new Error(`${tool.name} was cut into other regions since, or its plan leaves some out, so the two orders can't be compared.`);
  state.recorded = true;
  await tryOrder([...sequence]);
}

async function tryOrder(order, shown = () => {}) {
  state.order = order;
  state.whatif = null;
  paintOrder();
  shown();
  if (changed()) {
    const answer = await post(`/plans/${state.plan.id}/what-if`, { sequence: order });
    if (state.order === order) state.whatif = answer;
  }
  paintWhatIf();
}

function paintWhatIf() {
  const title = state.recorded ? "Your recorded order" : "Your change";
  if (!changed()) return fill(parts.whatif, h("h3", {}, state.recorded ? title : "What if?"), h("p.muted", {}, state.recorded ? "It is the order of the policy. Move a region to see what that would cost." : "Move a region below to another place and see what it would cost."));
  if (!state.whatif) return fill(parts.whatif, h("h3", {}, title), skeleton(2, ".9rem"));
  const { delta, features } = state.whatif;
  const signed = (value) => `${value < 0 ? "−" : "+"}${number(Math.abs(value))}`;
  const most = [...features].filter((entry) => Math.abs(entry.delta) > 1e-9).sort((a, b) => Math.abs(b.delta) - Math.abs(a.delta)).slice(0, 3);
  const verdict = Math.abs(delta) <= 1e-7 * Math.max(1, Math.abs(state.plan.cost)) ? "equally cheap" : signed(delta);
  return fill(parts.whatif, h("h3", {}, title, h("span.num", {}, verdict)),
    h("div.pay", {}, most.map((entry) => [h("span.swatch", { style: { "--swatch": entry.delta > 0 ? "var(--bad)" : "var(--ok)" } }), h("span", {}, entry.label), h("span.num", {}, signed(entry.delta))])),
    h("button.btn.small", { type: "button", style: { "margin-top": "var(--s-2)" }, onclick: back }, "Back to the cheapest order"));
}

function back() {
  state.recorded = false;
  state.order = [...state.plan.sequence];
  state.whatif = null;
  paintOrder();
  paintWhatIf();
}

function tile(region, i) {
  const step = state.plan.steps.find((entry) => entry.region === region);
  return h("button.tile", { type: "button", draggable: "true", style: sequenceStyle(i, state.order.length), dataset: { key: `tile-${region}`, tip: `Step ${i + 1}: ${step.name}. Alt with arrows moves it.` } }, h("span.seq-no", {}, i + 1), step.name);
}

function paintOrder() {
  fill(parts.tiles, state.order.map(tile));
  showOrder(state.stepper.step);
}

function showOrder(step) {
  const { tool, order } = state;
  state.view.show({ mode: "sequence", tool_id: tool.id, sequence: order, step: step < order.length ? step : null }, `${tool.name}, order after step ${step} of ${order.length}`);
}

function movable() {
  let lifted = -1;
  const place = (event) => [...parts.tiles.children].indexOf(event.target.closest(".tile"));
  parts.tiles.addEventListener("keydown", (event) => {
    const by = { ArrowLeft: -1, ArrowRight: 1 }[event.key];
    if (!by || !event.altKey) return;
    event.preventDefault();
    event.stopPropagation();
    move(place(event), place(event) + by).catch(complain);
  });
  parts.tiles.addEventListener("dragstart", (event) => { lifted = place(event); });
  parts.tiles.addEventListener("dragover", (event) => event.preventDefault());
  parts.tiles.addEventListener("drop", (event) => {
    event.preventDefault();
    if (lifted >= 0 && place(event) >= 0) move(lifted, place(event)).catch(complain);
    lifted = -1;
  });
}

// ---- head, proof, facts ------------------------------------------------------------------------------------------------------------

function paintHead() {
  const { tool, plan, policy } = state;
  const learned = `Learned from ${plural(policy.learned_from.demonstrations, "demonstration")} and ${plural(policy.learned_from.answers, "answer")}.`;
  fill(parts.head, h("div.title", {}, h("h1", {}, `The order for ${tool.name}`), h("p", {}, `${plan.demonstrated ? "You have demonstrated this tool." : "Nobody has demonstrated this tool."} ${learned}`)),
    doubt.node,
    h("button.icon-btn", { type: "button", "aria-label": "What it learned", dataset: { key: "weights", tip: "What it learned" }, onclick: () => certificate.open() }, icon("table")),
    h("button.icon-btn", { type: "button", "aria-label": "Export", dataset: { key: "export", tip: "Export: the order, its cost and its explanation as JSON" }, onclick: save }, icon("download")),
    h("div.next", { style: { "margin-left": "0" } }, h("p", {}, h("span.kicker", {}, "Next: watch the robot"), "in simulation"), h("a.btn.primary", { href: pageAddress(shell.projectId, "robot", { plan: plan.id }) }, "Open on the robot")));
}

// A count of one that isn't complete says nothing.
function equallyCheap({ ties, counted }) {
  if (ties === 1) return counted === "exactly" ? "this one only" : "not counted";
  return `${counted === "exactly" ? "" : "at least "}${Number(ties).toLocaleString("en")} orders`;
}

function paintProof() {
  const { plan } = state;
  parts.proof.dataset.proved = String(plan.proved);
  fill(parts.proof, icon(plan.proved ? "shield" : "warn"), h("div", {}, h("b", {}, plan.sureness),
    h("span.small.muted", { dataset: plan.proved ? {} : { tip: plan.method } }, plan.exception ? wantedWords(plan.exception) : plan.proved ? `Cheapest of all ${plan.constraints ? "orders that keep what you asked" : `${plan.orders} orders`}, in ${number(plan.milliseconds, 2)} ms` : `${plural(plan.sequence.length, "region")} are too many to look at every order${plan.bound === null ? "" : `; none costs less than ${number(plan.bound)}`}.${plan.looking ? " Looking for a closer limit." : ""}`)));
  certificate.show(state.policy, state.tool);
  doubt.show(state.policy, state.tool, plan);
  const fact = (term, value, tip = null) => h("div.fact", { dataset: tip ? { tip } : {} }, h("dt", {}, term), h("dd", {}, value));
  fill(parts.facts, fact("Cost", number(plan.cost), "C = w · Φ, added along the order; low is good"),
    fact("Equally cheap", equallyCheap(plan), "Orders in the lowest cost class (relative 1e-7)"),
    fact("Effort", plan.effort === null ? "not taught yet" : number(plan.effort), "eta, Eq. 8: breaks ties among equally cheap orders"),
    fact("Tie settled by", plan.tie_settled_by ?? (plan.ties === 1 ? "no tie" : "lowest letters")));
}

function save() {
  const link = h("a", { href: URL.createObjectURL(new Blob([JSON.stringify(state.plan, null, 2)], { type: "application/json" })), download: `${state.tool.name} order.json` });
  link.click();
  URL.revokeObjectURL(link.href);
}

// ---- reading -----------------------------------------------------------------------------------------------------------------------

function drawCrumb() {
  shell.crumb(state.tool.name, () => state.tools.map((tool) => ({ label: tool.name, note: tool.demonstrated ? "recorded" : "new", current: tool.id === state.tool.id, run: () => open(tool).catch(complain) })));
}

async function open(tool) {
  state.tool = tool;
  state.recorded = false;
  remember("tool", tool.id);
  const [regions, asked] = await Promise.all([all(`/tools/${tool.id}/regions`), lastAsked(tool)]);
  const names = [];
  for (const region of regions) names[region.id] = region.name;
  wishes.reset(names, asked);
  drawCrumb();
  await plan(wishes.asked);
}

let planned = 0;

async function plan(constraints) {
  const mine = (planned += 1);
  const made = await post(`/policies/${state.policy.id}/plans`, { tool_id: state.tool.id, constraints });
  if (mine !== planned) return;
  state.plan = made;
  state.order = [...state.plan.sequence];
  state.whatif = null;
  state.stepper.reset(state.order.length);
  paint();
}

// A closer limit was found for the plan that is shown; its order stays.
async function closer() {
  const { id } = state.plan;
  const now = await get(`/plans/${encodeURIComponent(id)}`);
  if (state.plan.id !== id) return;
  state.plan = now;
  paintProof();
}

// What the newest plan of this tool respects: wishes outlive a reload.
async function lastAsked(tool) {
  const plans = await all(`/policies/${state.policy.id}/plans`);
  return plans.find((entry) => entry.tool_id === tool.id)?.constraints ?? null;
}

function paint() {
  paintHead();
  paintProof();
  paintOrder();
  paintWhatIf();
  paintChart(); // last: it fills what the others leave
}

async function load() {
  state.policies = await all(`/projects/${shell.projectId}/policies`);
  state.policy = state.policies.reduce((latest, policy) => (!latest || policy.created_at > latest.created_at ? policy : latest), null);
  state.tools = (await all(`/projects/${shell.projectId}/tools`)).filter((tool) => tool.state === "ready");
  for (const tool of state.tools) names.set(tool.id, tool.name);
}

function showEmpty() {
  const none = state.tools.length === 0;
  fill(shell.main, h("div.head", {}, h("div.title", {}, h("h1", {}, "Policy"), h("p", {}, "The cheapest order for a tool nobody has demonstrated."))),
    h("div.empty", {}, h("h2", {}, none ? "No tool is ready yet" : "Nothing has been learned yet"), h("p", {}, none ? "Upload a tool first." : "Record demonstrations, then teach: Apprentice learns what makes your order good."),
      h("a.btn.primary", { href: pageAddress(shell.projectId, none ? "tools" : "teach") }, none ? "Go to the tools" : "Go to teach")));
}

async function build() {
  state.stepper = new Stepper({ n: 1, onStep: showOrder, name: "Play the order" });
  parts.stage.append(h("div.bl", {}, h("div.play", {}, state.stepper.node)));
  state.stepper.node.style.flex = "1";
  fill(shell.main, parts.head, h("div.policy-upper", {}, parts.stage, h("aside.card.fill", {}, parts.proof, certificate.line, parts.facts, wishes.node, parts.whatif)),
    h("section.card.policy-lower", { "aria-label": "Why this order" }, h("div.bar-head", {}, h("h2.nowrap", {}, "Why this order"), h("span.small.muted.nowrap", {}, "cost per step"), parts.legend), parts.chart, parts.tiles, h("p.underline", {}, "Drag a region to another place, or use Alt with the arrows.")), certificate.node);
  state.view = new View3D(parts.stage, { projectId: shell.projectId, name: "policy" });
  state.view.onPicked((region) => wishes.pick(region));
  movable();
  const wanted = query("tool");
  await open(state.tools.find((tool) => tool.id === wanted) ?? state.tools.find((tool) => !tool.demonstrated) ?? state.tools[0]);
  addEventListener("resize", gathered(paintChart, 150));
  addEventListener("themechange", paint);
}

// One reading after the other, so that what is told during one is read by the next and nothing is drawn twice.
let reading = Promise.resolve();
const anew = () => (reading = reading.then(read).catch(complain));

async function read() {
  await load();
  if (!state.policy || !state.tools.length) return showEmpty();
  return state.view ? open(state.tools.find((tool) => tool.id === state.tool.id) ?? state.tools[0]) : build();
}

try {
  for (const type of ["policy.changed", "resync"]) listen(type, gathered(anew, 200));
  const looked = gathered(() => closer().catch(complain), 100);
  listen("plan.changed", ({ plan_id: id }) => id === state.plan?.id && state.plan.looking && looked());
  await (reading = read());
} catch (error) {
  showFault(shell.main, error);
  throw error;
}
