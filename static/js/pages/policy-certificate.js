// What is proved about a policy, in plain words: a line beside the order, and a dialog with the recorded orders, the sets that
// contradict each other, how sure each tool is, what was learned about every weight and which interactions were tested.

import { fill, h } from "../dom.js";
import { icon } from "../icons.js";
import { pageAddress } from "../shell.js";
import { drawTool } from "../thumbnail.js";
import { number, plural, sure } from "../words.js";
import { settled } from "./teach-start.js";

const NOTHING = 1e-7; // relative extra cost that is none

const percent = (share) => `${share > 0 && share < 0.01 ? "under 1" : Math.round(100 * share)} %`;
const dearer = (extra) => (extra <= NOTHING ? "nothing" : `${number(100 * extra, 2)} %`);

/** The claim in one sentence, and what stands behind it. */
export function verdict({ certificate }) {
  if (!certificate) return { mark: "half", tone: "warn", title: "Learned as in the paper", text: "Step by step until nothing changed. That proves nothing about other orders." };
  const conflicts = certificate.conflicts?.length ?? 0;
  if (certificate.kind === "likelihood") {
    const why = conflicts ? "No weights explain all of them, so exceptions are allowed for." : "Exceptions are allowed for: that predicts your orders better than weights that explain each exactly.";
    return { mark: "half", tone: "warn", title: `Predicts ${certificate.held_out_hits} of your ${plural(certificate.of, "order")}`, text: ["Each was left out of learning in turn.", why, certificate.exactness].filter(Boolean).join(" ") };
  }
  if (!certificate.realisable) return { mark: "warn", tone: "bad", title: "Not every recorded order is a cheapest one", text: "No weights explain all of them; these come nearest." };
  const next = certificate.margin > 0 ? `The nearest other order met costs ${dearer(certificate.margin)} more.` : "";
  return { mark: "shield", tone: "ok", title: "Every recorded order is a cheapest one", text: `${certificate.proved ? "Proved by looking at all orders of every recorded tool." : "As far as a search of the larger tools can tell."} ${next}` };
}

export class Certificate {
  // `names`: tool id -> name now. `onCompare(toolId, sequence)`: show a recorded order beside the cheapest one.
  constructor({ projectId, names, onCompare }) {
    this.projectId = projectId;
    this.names = names;
    this.onCompare = onCompare;
    this.node = h("dialog.card.pad.keys.weights.certificate", { "aria-label": "What the policy has learned" });
    this.line = h("button.learned-line", { type: "button", hidden: true, dataset: { key: "certificate" }, onclick: () => this.open() });
  }

  show(policy, tool) {
    this.policy = policy;
    this.line.hidden = false;
    const { mark, tone, title } = verdict(policy);
    this.line.dataset.tip = "How sure: the share of all weights that agree with what you showed under which this order is among the cheapest";
    fill(this.line, h(`span.tone.${tone}`, {}, icon(mark)), h("span", {}, h("b.strong", {}, title), h("span.small.muted", {}, this.ofTool(tool))), icon("right"));
  }

  // How sure the order of one tool is.
  ofTool(tool) {
    const { certificate } = this.policy;
    const chance = certificate?.tools?.find((entry) => entry.tool_id === tool.id);
    if (chance) return `Sure of this order: ${sure(chance)}`;
    const shown = certificate?.demonstrations?.find((entry) => entry.tool_id === tool.id);
    if (shown) return shown.slack > NOTHING ? `Your order of ${tool.name} costs ${dearer(shown.slack)} more than the cheapest` : `Your order of ${tool.name} is among the cheapest`;
    return certificate ? "How sure this order is: known after learning again" : "What that means";
  }

  name(entry) {
    return entry.tool_name ?? this.names.get(entry.tool_id) ?? "A tool";
  }

  open() {
    const { policy } = this;
    const { title, text } = verdict(policy);
    const certificate = policy.certificate ?? {};
    fill(this.node, h("h2", {}, title), h("p.small.muted", {}, text), this.conflicts(certificate.conflicts ?? []), this.recorded(certificate.demonstrations ?? []), this.chances(certificate), this.interactions(certificate.interactions ?? []), this.weights(policy), this.effort(policy),
      h("form", { method: "dialog" }, h("button.btn", {}, "Close")));
    this.node.showModal();
    for (const canvas of this.node.querySelectorAll("canvas.mini")) drawTool(canvas, canvas.dataset.tool, { sequence: JSON.parse(canvas.dataset.sequence) });
    this.node.scrollTop = 0;
  }

  conflicts(sets) {
    if (!sets.length) return null;
    return h("section", {}, h("h3", {}, "Orders that no rule explains together"), h("p.small.muted", {}, "Without any one of a set the rest of it fits. In brackets, how much dearer that order is when the others are explained. Click one to see why."),
      sets.map((set) => h("div.conflict", {}, h("div.conflict-tools", {}, set.tools.map((entry) => this.picture(entry))), h("p.small", {}, set.tools.length === 1 ? "No weights make this order a cheapest one, not even alone. " : "", set.resolved || `Nothing that was tried resolves it: record ${set.tools.length === 1 ? "it" : "one of them"} again, or leave it out.`))));
  }

  picture(entry) {
    const words = `${this.name(entry)} (${number(100 * entry.slack, 2)} %)`;
    if (!entry.sequence) return h("a", { href: pageAddress(this.projectId, "record", { tool: entry.tool_id }) }, words);
    return h("button", { type: "button", dataset: { tip: "Your order in 3D, and through which features it costs more than the cheapest" }, onclick: () => this.compare(entry) },
      h("canvas.mini", { dataset: { tool: entry.tool_id, sequence: JSON.stringify(entry.sequence) }, "aria-hidden": "true" }), h("span.small", {}, words));
  }

  compare(entry) {
    this.node.close();
    return this.onCompare(entry.tool_id, entry.sequence);
  }

  recorded(demonstrations) {
    if (!demonstrations.length) return null;
    const row = (entry) => h("tr", {}, h("td", {}, entry.sequence ? h("button.link", { type: "button", onclick: () => this.compare(entry) }, this.name(entry)) : this.name(entry)),
      h("td", {}, entry.slack > NOTHING ? `costs ${dearer(entry.slack)} more than the cheapest` : "a cheapest order"), h("td.num", {}, entry.ties === null || entry.ties === undefined ? "" : Number(entry.ties).toLocaleString("en")));
    return h("section", {}, h("h3", {}, "Your recorded orders"), h("table", {}, h("thead", {}, h("tr", {}, h("th", {}, "Tool"), h("th", {}, "Your order is"), h("th.num", { dataset: { tip: "Orders of the lowest cost, whose features add up the same" } }, "Equally cheap"))), h("tbody", {}, demonstrations.map(row))));
  }

  chances(certificate) {
    const tools = certificate.tools ?? [];
    if (!tools.length) return null;
    const row = (entry) => h("tr", {}, h("td", {}, this.name(entry)), h("td.num", {}, sure(entry)), h("td.num", {}, dearer(entry.extra)), h("td.small", {}, entry.agreed ? settled(entry) : h("a", { href: pageAddress(this.projectId, "record", { tool: entry.tool_id }) }, "record it")));
    return h("section", {}, h("h3", {}, "Tools nobody has recorded"), h("p.small.muted", {}, `Expect ${number(certificate.expected_wrong, 2)} of ${tools.length} to have a better order than the one chosen.`),
      h("table", {}, h("thead", {}, h("tr", {}, h("th", {}, "Tool"), h("th.num", { dataset: { tip: "Share of the weights that agree with all you said under which the chosen order is among the cheapest" } }, "Order is right"), h("th.num", { dataset: { tip: certificate.kind === "likelihood" ? "How much more the chosen order costs than the best one, under 95 % of these weights" : "How much more the chosen order could cost than the best one, under any of these weights" } }, "At worst dearer by"), h("th", {}, ""))), h("tbody", {}, tools.map(row))));
  }

  interactions(tested) {
    if (!tested.length) return null;
    return h("section", {}, h("h3", {}, "What was suspected to act together"), h("ul.plain", {}, tested.map((entry) => h("li.small", {}, icon(entry.kept ? "check" : "minus"), entry.words))));
  }

  weights(policy) {
    const measured = policy.weights.some((weight) => weight.interval);
    const most = Math.max(1e-12, ...policy.weights.map((weight) => (measured ? Math.max(...weight.interval.map(Math.abs), Math.abs(weight.share)) : Math.abs(weight.value))));
    const place = (value) => `${(100 * Math.abs(value)) / most}%`;
    const bar = (weight) => {
      if (!measured) return h("div.progress", {}, h("i", { style: { width: place(weight.value) } }));
      const [low, high] = weight.interval;
      const from = low * high < 0 ? 0 : Math.min(Math.abs(low), Math.abs(high));
      return h("div.band", { role: "img", "aria-label": `between ${percent(low)} and ${percent(high)}` }, h("i", { style: { left: place(from), width: place(Math.max(Math.abs(low), Math.abs(high)) - from) } }), h("b", { style: { left: place(weight.share) } }));
    };
    const words = (weight) => {
      if (!weight.identifiable) return "not decided";
      return measured ? `${percent(weight.interval[0])} to ${percent(weight.interval[1])}` : number(weight.value);
    };
    const tip = (weight) => (weight.identifiable ? `${weight.symbol} = ${number(weight.value)}` : "The recorded orders do not decide this: it can be anything without changing which of them is cheapest.");
    const row = (weight) => h(`tr${weight.identifiable ? "" : ".open"}`, { dataset: { tip: tip(weight) } }, h("td", {}, weight.label), h("td.num", {}, measured ? percent(weight.share) : ""), h("td", { style: { width: "9rem" } }, weight.identifiable ? bar(weight) : null), h("td.small", {}, words(weight)));
    return h("section", {}, h("h3", {}, "What costs"), h("p.small.muted", {}, `${policy.name}. ${measured ? "How much of the cost hangs on each feature; the band holds nine tenths of the weights that agree with what you showed." : "A larger weight makes it dearer."} Feature set ${policy.feature_set}.`),
      h("table", {}, h("thead", {}, h("tr", {}, h("th", {}, "What costs"), h("th.num", {}, measured ? "Share" : ""), h("th", {}, ""), h("th", {}, measured ? "Could be" : "Weight"))), h("tbody", {}, policy.weights.map(row))));
  }

  effort(policy) {
    if (!policy.effort_weights) return null;
    return h("section", {}, h("h3", {}, "Effort"), h("table", {}, h("tbody", {}, policy.effort_weights.map((weight) => h("tr", {}, h("td", {}, weight.label), h("td.num", {}, number(weight.value)))))));
  }
}
