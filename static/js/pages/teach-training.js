// The training strip: iteration, loss and violations in words, and the learning curves when it is opened.

import { get } from "../api.js";
import { drawCurves } from "../curves.js";
import { fill, h } from "../dom.js";
import { icon } from "../icons.js";
import { number, plural } from "../words.js";

const TERMS = [
  { key: "alpha", name: "average order", colour: "var(--c-1)", symbol: "alpha: distance to the average sampled order" },
  { key: "beta", name: "closest order", colour: "var(--c-2)", symbol: "beta: distance to the closest sampled order" },
  { key: "gamma", name: "cheapest order", colour: "var(--c-4)", symbol: "gamma: distance to the cheapest order" },
  { key: "regularisation", name: "small weights", colour: "var(--c-3)", symbol: "lambda: keeps the weights small" },
];

const OPEN_TERMS = [
  { key: "open", name: "tools that may be wrong", colour: "var(--c-1)", symbol: "sum over the tools nobody has recorded of the probability that the chosen order is not the best" },
  { key: "slack", name: "slack", colour: "var(--c-2)", symbol: "how much the recorded orders cost above the cheapest, relative" },
];
const termsOf = (run) => (run?.mode === "certified" ? OPEN_TERMS : TERMS);

const NOTES = {
  effort: "The effort run has no steps of its own: after each round of answers it solves for the start and end you like best.",
  exception: "After each answer, orders it speaks against become improbable; after three at most the likeliest one counts for this tool.",
};
const KEY_FACTS = 4;

export const explained = (violations) => (violations === 0 ? "every demonstration explained" : `${plural(violations, "demonstration")} not yet explained`);

function openWords({ terms }) {
  if (terms.open < 0.05) return "no tool left open";
  const count = number(terms.open, 2);
  return `about ${count} ${count === "1" ? "tool" : "tools"} may get a wrong order`;
}

const shown = (value) => (typeof value === "boolean" ? (value ? "yes" : "no") : number(value));

export class Training {
  constructor({ onCancel }) {
    this.onCancel = onCancel;
    this.items = [];
    this.runId = null;
    this.loss = h("div.chart");
    this.missed = h("div.chart");
    this.facts = h("span.facts");
    this.state = h("span.push");
    this.parameters = h("dl.stack", { style: { gap: "var(--s-2)" } });
    this.legend = h("div.legend");
    this.stop = h("button.btn.small", { type: "button", onclick: () => this.onCancel() }, "Stop training");
    this.plots = h("div.plots", {}, h("div", {}, this.loss, this.legend), this.missed, this.parameters);
    this.note = h("p.small.muted", { style: { padding: "var(--s-2) var(--s-4) var(--s-4)" } });
    this.node = h("details.card.drawer", { ontoggle: () => this.draw() }, h("summary", {}, icon("right", "caret"), h("h2", {}, "Training"), this.facts, this.state),
      this.plots, this.note, h("div", { style: { padding: "0 var(--s-4) var(--s-4)" } }, this.stop));
    new ResizeObserver(() => this.draw()).observe(this.plots);
    addEventListener("themechange", () => this.draw());
  }

  // tall: the run is at work and nothing else is on the page.
  show(run, { tall = false } = {}) {
    if (run.id !== this.runId) this.items = [];
    this.runId = run.id;
    this.run = run;
    const facts = run.kind === "performance" ? [run.iteration ? `step ${run.iteration}` : null, run.loss === null ? null : run.mode === "certified" ? openWords(run) : `loss ${number(run.loss)}`, run.violations === null ? null : explained(run.violations)] : [`round ${run.round}`, plural(run.answered, "answer")];
    fill(this.legend, termsOf(run).map((term) => h("span", { dataset: { tip: term.symbol } }, h("i.stroke", { style: { "--swatch": term.colour } }), term.name)));
    fill(this.facts, facts.filter(Boolean).map((text) => h("span", {}, text)));
    const words = { queued: "about to start", training: "learning", waiting_for_expert: "paused until you answer", cancelling: "stopping" };
    this.state.textContent = words[run.state] ?? "";
    this.stop.hidden = !["queued", "training", "waiting_for_expert"].includes(run.state);
    this.plots.classList.toggle("tall", tall);
    this.plots.hidden = run.kind !== "performance";
    this.note.textContent = run.kind === "performance" ? "" : NOTES[run.kind];
    this.note.hidden = run.kind === "performance";
    if (tall) this.node.open = true;
    this.drawParameters(run);
  }

  drawParameters(run) {
    const changed = run.parameters.filter((entry) => entry.value !== entry.default);
    const chosen = [...changed, ...run.parameters.filter((entry) => !changed.includes(entry))].slice(0, KEY_FACTS);
    fill(this.parameters, chosen.map((entry) => h("div.fact", {}, h("dt", {}, h("span.symbol", { tabindex: "0", dataset: { tip: `${entry.symbol}, usually ${shown(entry.default)}` } }, entry.label)), h("dd", {}, shown(entry.value)))));
  }

  // Reads what is new since the last iteration known.
  async load() {
    if (!this.runId || this.run.kind !== "performance") return;
    const run = this.runId;
    const last = this.items.at(-1)?.iteration ?? 0;
    const page = await get(`/runs/${encodeURIComponent(run)}/metrics${last ? `?after=${last}` : ""}`);
    if (run !== this.runId) return;
    const known = new Set(this.items.map((item) => item.iteration));
    this.items.push(...page.items.filter((item) => !known.has(item.iteration)));
    this.items.sort((a, b) => a.iteration - b.iteration);
    this.draw();
  }

  draw() {
    if (!this.node.open || !this.node.isConnected || this.plots.hidden) return;
    const x = this.items.map((item) => item.iteration);
    drawCurves(this.loss, { title: this.run.mode === "certified" ? "What is still open" : "Loss, by part", x, series: termsOf(this.run).map((term) => ({ name: term.name, colour: term.colour, values: this.items.map((item) => item.terms[term.key]) })) });
    drawCurves(this.missed, { title: "Demonstrations not yet explained", x, whole: true, series: [{ name: "not explained", colour: "var(--ink)", values: this.items.map((item) => item.violations) }] });
  }
}
