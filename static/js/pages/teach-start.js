// What can be learned next: cards for the performance and the effort run, with every parameter in a drawer. And the card that
// says how the last run ended.

import { get, post } from "../api.js";
import { fill, h } from "../dom.js";
import { icon } from "../icons.js";
import { pageAddress } from "../shell.js";
import { complain } from "../toasts.js";
import { ago, number, plural, sure } from "../words.js";
import { readExperts } from "./teach-experts.js";

function parameterField(entry) {
  if (typeof entry.value === "boolean") return h("label.check", {}, h("input", { type: "checkbox", name: entry.key, checked: entry.value }), h("span.symbol", { dataset: { tip: `${entry.symbol} in the effort's features, usually ${entry.default ? "on" : "off"}` } }, entry.label));
  const field = h("input.field", { type: "number", step: "any", value: String(entry.value ?? ""), name: entry.key, "aria-label": entry.label, placeholder: entry.default === null ? "none" : String(entry.default) });
  return h("label", {}, h("span", {}, h("span.symbol", { dataset: { tip: `${entry.symbol} in the paper, usually ${number(entry.default)}` } }, entry.label)), field);
}

const MODES = { certified: "With proof, asks about new tools", paper: "As in the paper, step by step" };

// A performance run has two ways to learn, each with its own parameters.
async function modeDrawer(projectId) {
  const drawers = Object.fromEntries(await Promise.all(Object.keys(MODES).map(async (mode) => [mode, await parameterDrawer(projectId, "performance", mode)])));
  const choice = h("select.field", { name: "mode", "aria-label": "How it learns", style: { width: "100%" }, onchange: () => show() }, Object.entries(MODES).map(([value, words]) => h("option", { value }, words)));
  const place = h("div", { style: { width: "100%" } });
  const show = () => fill(place, drawers[choice.value].node);
  show();
  return { node: h("div", { style: { width: "100%" } }, h("label.stack", { style: { gap: "var(--s-1)" } }, h("span.small.muted", {}, "How it learns"), choice), place), mode: () => choice.value, values: () => drawers[choice.value].values(), seed: () => drawers[choice.value].seed() };
}

async function parameterDrawer(projectId, kind, mode = "certified") {
  const { parameters } = await get(`/projects/${encodeURIComponent(projectId)}/run-defaults?kind=${kind}&mode=${mode}`);
  const seed = h("label", {}, h("span.symbol", { dataset: { tip: "The same seed and the same answers give the same policy" } }, "Seed of the random draws"), h("input.field", { type: "number", step: "1", min: "0", name: "seed", placeholder: "any" }));
  const node = h("details.drawer", { style: { width: "100%" } }, h("summary", { style: { padding: "0" } }, icon("right", "caret"), h("h2", {}, "Parameters"), h("span", {}, "usual values")), h("div.params", { style: { padding: "0" } }, parameters.map(parameterField), seed));
  const words = node.querySelector("summary > span");
  const values = () => {
    const params = {};
    for (const entry of parameters) {
      const field = node.querySelector(`[name="${entry.key}"]`);
      if (typeof entry.value === "boolean") {
        if (field.checked !== entry.value) params[entry.key] = field.checked;
        continue;
      }
      const text = field.value;
      if (text !== "" && Number(text) !== entry.value) params[entry.key] = Number(text);
    }
    return params;
  };
  node.addEventListener("input", () => {
    const count = Object.keys(values()).length;
    words.textContent = count ? `${plural(count, "value")} changed` : "usual values";
  });
  return { node, values, seed: () => (seed.querySelector("input").value === "" ? null : Number(seed.querySelector("input").value)) };
}

function startButton(projectId, kind, drawer, primary, words, reason, onStarted, experts = null) {
  const fault = h("p.error-text", { role: "alert" });
  const button = h(`button.btn${primary && !reason ? ".primary" : ""}`, { type: "button", dataset: { tip: reason ?? "" }, "aria-disabled": reason ? "true" : null, onclick: async () => {
    if (reason || button.disabled) return;
    const authors = experts ? experts.chosen() : [];
    if (experts && !authors.length) {
      fault.textContent = "Choose at least one expert whose orders it learns from.";
      return;
    }
    button.disabled = true;
    fault.textContent = "";
    try {
      const seed = drawer.seed();
      onStarted(await post(`/projects/${encodeURIComponent(projectId)}/runs`, { kind, ...(drawer.mode ? { mode: drawer.mode() } : {}), params: drawer.values(), authors, ...(seed === null ? {} : { seed }) }));
    } catch (error) {
      fault.textContent = error.message;
    }
    button.disabled = false;
  } }, icon("play"), words);
  return [button, fault];
}

// The two cards. `learned`: a performance policy exists.
export async function startCards({ project, runs, onStarted }) {
  const learned = runs.some((run) => run.kind === "performance" && run.state === "converged");
  const [performance, effort, experts] = await Promise.all([modeDrawer(project.id), parameterDrawer(project.id, "effort"), readExperts(project.id)]);
  const count = project.counts.demonstrations;
  const empty = count === 0 ? "Record at least one demonstration first" : null;
  const before = learned ? null : "Learn what makes an order good first: this decides between orders that are equally good";
  return h("div.kinds", {},
    h("section.card.kind", {}, h("h2", {}, "What makes an order good"),
      h("p", {}, count ? `Learns from ${plural(count, "demonstration")} what an order should cost, and asks you about tools that can still go more than one way.` : "Learns from your demonstrations. There is none yet."),
      experts?.choice, startButton(project.id, "performance", performance, !learned, learned ? "Learn again" : "Start learning", empty, onStarted, experts),
      count ? performance.node : h("a.btn", { href: pageAddress(project.id, "record") }, "Record a demonstration")),
    h("section.card.kind", {}, h("h2", {}, "Which good order is less effort"),
      h("p", {}, "Some orders are equally good, but one starts or ends where it suits you better. Asks you which of two is less effort."),
      startButton(project.id, "effort", effort, learned, "Start asking", empty ?? before, onStarted), learned ? effort.node : null), experts?.node);
}

function learnedWords(run) {
  if (run.kind === "exception") return "The questions about this tool are over";
  if (run.kind !== "performance") return "Learned: which order is less effort";
  return run.violations ? "Learned, but not every recorded order is the best one" : "Learned: every demonstration is explained";
}

const OUTCOMES = {
  converged: (run) => ({ tone: "ok", mark: "shield", title: learnedWords(run), text: `${plural(run.asked, "question")} asked, ${run.answered} answered.` }),
  stalled: () => ({ tone: "warn", mark: "warn", title: "Nothing is left to ask", text: "Every order that was shown is as good as yours by your own answers. You can take what was learned, or record one more demonstration." }),
  infeasible: () => ({ tone: "bad", mark: "warn", title: "Some demonstrations contradict each other", text: "No weights explain all of them. Nothing is lost: record one again, or go on with the weights that explain the most." }),
  failed: () => ({ tone: "bad", mark: "warn", title: "The run stopped with an error", text: "It can go on from where it was saved last." }),
  cancelled: () => ({ tone: "", mark: "stop", title: "The run was stopped", text: "Your answers are kept." }),
};

// Links to the tools whose orders contradict the others; to all demonstrations where it isn't known which they are.
function recordAgain(run, project, tools) {
  const odd = (run.error?.tools ?? []).map((id) => tools.find((tool) => tool.id === id)).filter(Boolean);
  if (!odd.length) return [h("a.btn", { href: pageAddress(project.id, "record") }, "Look at the demonstrations")];
  return odd.map((tool, i) => h(`a.btn${i === 0 && odd.length === 1 ? ".primary" : ""}`, { href: pageAddress(project.id, "record", { tool: tool.id }) }, `Record ${tool.name} again`));
}

function outcomeActions(run, project, act, tools) {
  const button = (words, action, primary = false) => h(`button.btn${primary ? ".primary" : ""}`, { type: "button", onclick: () => act(action).catch(complain) }, words);
  if (run.state === "converged") return [h("a.btn.primary", { href: pageAddress(project.id, "policy", run.about ? { tool: run.about } : {}) }, run.about ? "See the order" : "See the policy")];
  if (run.state === "stalled") return [button("Take what was learned", "finish", true), h("a.btn", { href: pageAddress(project.id, "coverage") }, "What to record next")];
  if (run.state === "failed" || run.state === "cancelled") return [button("Go on", "resume", true)];
  if (run.state === "infeasible") return [...recordAgain(run, project, tools), button("Use the best compromise", "finish")];
  return [];
}

// Orders that differ by less than anybody would notice count as settled too.
export function settled({ extra }) {
  return extra < 1e-7 ? "settled" : h("span", { dataset: { tip: `Another order may be better, by ${number(100 * extra, 2)} % of the cost at most: too little to ask about` } }, "good enough");
}

// How sure the choice is on each tool nobody has recorded, and on which demonstrations the weights fall short.
function chances(report, project) {
  if (!report) return null;
  const odd = report.demonstrations.filter((entry) => entry.slack > 1e-7);
  const row = (tool) => h("tr", {}, h("td", {}, tool.tool_name), h("td.num", { dataset: { tip: "Share of the weights that agree with all you said under which the chosen order is among the cheapest" } }, sure(tool)),
    h("td.num", { dataset: { tip: "How much more the chosen order could cost than the best one, under any of these weights" } }, tool.extra < 1e-7 ? "nothing" : `${number(100 * tool.extra, 2)} %`),
    h("td", {}, tool.agreed ? settled(tool) : h("a", { href: pageAddress(project.id, "record", { tool: tool.tool_id }) }, "record it")));
  const exclude = (report.conflicts ?? []).map((conflict) => h("li", {}, conflict.tools.map((entry, i) => [i ? ", " : "", h("a", { href: pageAddress(project.id, "record", { tool: entry.tool_id }) }, entry.tool_name), h("span.muted", { dataset: { tip: "How much dearer its order is when the others are explained" } }, ` (${number(100 * entry.slack, 2)} %)`)]), ` exclude each other; without any one of them the rest fits. ${conflict.resolved}`));
  return [exclude.length ? h("ul", {}, exclude) : null, odd.length ? h("p", {}, "Under the weights found: ", odd.map((entry, i) => [i ? ", " : "", h("a", { href: pageAddress(project.id, "record", { tool: entry.tool_id }) }, entry.tool_name), ` costs ${number(100 * entry.slack, 2)} % more than its cheapest order`]), ".") : null,
    report.tools.length ? h("details.drawer", { open: true, style: { width: "100%" } }, h("summary", { style: { padding: "0" } }, icon("right", "caret"), h("h2", {}, "Tools nobody has recorded"), h("span", {}, `about ${number(report.expected_wrong, 2)} of ${report.tools.length} may have a better order`)),
      h("table.run-list", {}, h("thead", {}, h("tr", {}, h("th", {}, "Tool"), h("th.num", {}, "Order is right"), h("th.num", {}, "At worst dearer by"), h("th", {}, ""))), h("tbody", {}, report.tools.map(row)))) : null];
}

const SAID = { left: "the left order", right: "the right order", equal: "that both are about equal" };

// Answers that contradict each other were weighed; those that sit ill with the others can be taken back, one by one.
function doubts(report, takeBack) {
  if (!report) return null;
  const row = (entry) => h("li", {}, h("span", {}, h("b", {}, entry.tool_name), `: you chose ${SAID[entry.value] ?? entry.value}. ${entry.difference}`), h("button.btn.small", { type: "button", dataset: { key: `doubt-${entry.answer_id}` }, onclick: () => takeBack(entry) }, icon("undo"), "Take it back"));
  return [report.consistency?.text ? h("p", {}, report.consistency.text) : null,
    report.unclear?.length ? h("div.note.warn.doubts", {}, icon("warn"), h("div", {}, h("p", {}, `${report.unclear.length === 1 ? "This answer sits" : "These answers sit"} ill with the others. All were weighed against each other, so nothing has to be done.`), h("ul", {}, report.unclear.map(row)))) : null];
}

export function outcomeCard({ run, project, act, tools = [], takeBack }) {
  const outcome = OUTCOMES[run.state]?.(run);
  if (!outcome) return null;
  const details = [run.message, typeof run.error === "string" ? run.error : run.error?.detail].filter(Boolean);
  return h("section.card.outcome", { "aria-label": "How it ended" }, h(`span.chip${outcome.tone ? `.${outcome.tone}` : ""}`, {}, icon(outcome.mark), `${{ performance: "Learning", effort: "Preferences", exception: "One tool" }[run.kind]}, ${ago(run.updated_at)}`),
    h("h2", {}, outcome.title), h("p", {}, outcome.text), [...new Set(details)].map((text) => h("p", {}, text)), doubts(run.report, takeBack), chances(run.report, project), h("div.actions", {}, outcomeActions(run, project, act, tools)));
}
