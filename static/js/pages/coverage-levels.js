// Where small values of a feature end and large ones begin: a histogram of its values on the project's tools with two handles.

import { put, remove } from "../api.js";
import { fill, h } from "../dom.js";
import { complain, toast } from "../toasts.js";
import { number, sentence } from "../words.js";

const STEPS = 400; // of a handle, from the least to the most value
const RULES = { quantile: "equally common", range: "equally wide", expert: "set by you" };

export class Levels {
  // `onReport(report)`: the coverage under the new levels.
  constructor({ projectId, onReport }) {
    this.projectId = projectId;
    this.onReport = onReport;
    this.rows = h("div.level-rows");
    this.node = h("details", { name: "coverage-more" }, h("summary", {}, "Where does small end and large begin?"), this.rows);
  }

  show(thresholds) {
    fill(this.rows, h("p.small.muted", {}, "Every value of a feature is small, middle or large. Move a handle where you see it differently; the bars are the values on your tools."), thresholds.map((entry) => this.row(entry)));
  }

  row(entry) {
    const { feature, label, rule, least, most } = entry;
    const span = most - least || 1;
    const at = { low: (entry.low - least) / span, high: (entry.high - least) / span };
    const tallest = Math.max(1, ...entry.counts);
    const bars = entry.counts.map((count) => h("i", { style: { height: `${Math.max(count ? 6 : 0, (100 * count) / tallest)}%` } }));
    const words = h("span.small.muted.num");
    const value = (share) => least + share * span;
    const paint = () => {
      bars.forEach((bar, k) => {
        const middle = (k + 0.5) / bars.length;
        bar.dataset.level = middle <= at.low ? "small" : middle <= at.high ? "middle" : "large";
      });
      words.textContent = `up to ${number(value(at.low))}, from ${number(value(at.high))}`;
    };
    const handle = (side, name) => {
      const input = h(`input.handle.${side}`, { type: "range", min: "0", max: String(STEPS), step: "1", value: String(Math.round(Math.min(1, Math.max(0, at[side])) * STEPS)), "aria-label": `${sentence(label)}: ${name}`, dataset: { key: `level-${feature}-${side}` } });
      const spoken = () => input.setAttribute("aria-valuetext", number(value(at[side])));
      input.addEventListener("input", () => {
        const wanted = Number(input.value) / STEPS;
        at[side] = side === "low" ? Math.min(wanted, at.high) : Math.max(wanted, at.low);
        input.value = String(Math.round(at[side] * STEPS));
        spoken();
        paint();
      });
      input.addEventListener("change", () => this.save(entry, value(at.low), value(at.high)));
      spoken();
      return input;
    };
    const chip = h("span.chip.small", { dataset: { tip: rule === "expert" ? "Your own thresholds count." : `Small, middle and large are ${RULES[rule]} on your tools.` } }, RULES[rule]);
    const reset = rule === "expert" ? h("button.btn.small", { type: "button", "aria-label": `Back to the usual levels of ${label}`, dataset: { key: `level-reset-${feature}` }, onclick: () => this.reset(entry) }, "Reset") : null;
    const node = h("div.level-row", {}, h("div.level-head", {}, h("b.strong", {}, sentence(label)), chip, reset, words), h("div.level-track", {}, h("div.level-bars", { "aria-hidden": "true" }, bars), handle("low", "small ends at"), handle("high", "large begins at")));
    paint();
    return node;
  }

  address(entry) {
    return `/projects/${encodeURIComponent(this.projectId)}/levels/${encodeURIComponent(entry.feature)}`;
  }

  back(entry) {
    return entry.rule === "expert" ? put(this.address(entry), { rule: "expert", low: entry.low, high: entry.high }) : remove(this.address(entry));
  }

  async save(entry, low, high) {
    try {
      this.onReport(await put(this.address(entry), { rule: "expert", low, high }));
      toast(`${sentence(entry.label)} is small up to ${number(low)} and large from ${number(high)}.`, { undo: async () => this.onReport(await this.back(entry)) });
    } catch (error) {
      complain(error);
    }
  }

  async reset(entry) {
    try {
      this.onReport(await remove(this.address(entry)));
      toast(`${sentence(entry.label)} has its usual levels again.`, { undo: async () => this.onReport(await this.back(entry)) });
    } catch (error) {
      complain(error);
    }
  }
}
