// The panel of one tool: what its import asks, how far it is, why it failed, or its regions.

import { patch, post } from "../api.js";
import { fill, h } from "../dom.js";
import { icon } from "../icons.js";
import { tint } from "../ramp.js";
import { renameable } from "../rename.js";
import { fixed, number, plural } from "../words.js";

const METRES = { mm: 0.001, cm: 0.01, m: 1, in: 0.0254 };
const UNIT_WORDS = { mm: "Millimetres", cm: "Centimetres", m: "Metres", in: "Inches" };
const LEVELS = { info: ["info", ""], repaired: ["check", "ok"], warning: ["warn", "warn"] };

// "120 x 80 x 32 mm": what the part would measure if the file were written in this unit.
export function sizeIn(unit, extents) {
  const metres = extents.map((length) => length * METRES[unit]);
  const large = Math.max(...metres) >= 1;
  return `${metres.map((length) => number(large ? length : length * 1000)).join(" \u00d7 ")} ${large ? "m" : "mm"}`;
}

function upWords(direction) {
  const axis = direction[1].toUpperCase();
  return direction[0] === "+" ? `${axis} up` : `${axis} down`;
}

// The whole text on hover, but only where the column cuts it.
function tipWhenCut({ currentTarget: cell }) {
  if (cell.scrollWidth > cell.clientWidth) cell.dataset.tip = cell.textContent;
  else delete cell.dataset.tip;
}

export class ToolPanel {
  constructor({ onHighlight, onChanged, onDelete, reload }) {
    this.onHighlight = onHighlight;
    this.onChanged = onChanged;
    this.onDelete = onDelete;
    this.reload = reload;
    this.node = h("aside.card.fill", { "aria-label": "Tool" });
    this.shown = "";
  }

  show(tool, regions, highlight) {
    const key = JSON.stringify([tool.id, tool.state, tool.version, tool.name, tool.segmentation_id, tool.report, tool.error, regions.map((region) => region.name), document.documentElement.dataset.theme]);
    this.tool = tool;
    if (key !== this.shown && !this.node.querySelector(".rename input, .ask-form")) this.draw(tool, regions);
    else if (key !== this.shown && !(tool.state === "asking" && this.asked === tool.id)) this.draw(tool, regions);
    this.shown = key;
    this.asked = tool.state === "asking" ? tool.id : null;
    this.mark(highlight);
    if (tool.job) this.progress(tool.job);
  }

  draw(tool, regions) {
    const body = { asking: () => this.questions(tool), importing: () => this.importing(tool), failed: () => this.failed(tool), ready: () => this.ready(tool, regions) }[tool.state]();
    fill(this.node, this.head(tool), body);
  }

  head(tool) {
    const name = renameable(tool.name, "tool", async (wanted) => {
      this.onChanged(await patch(`/tools/${encodeURIComponent(tool.id)}`, { name: wanted }, this.tool.version));
    }, "h2.rename");
    return h("div.card-head", {}, name, h("span.push.small.muted.num", {}, tool.state === "ready" ? plural(tool.region_count, "region") : ""),
      h("button.icon-btn", { type: "button", "aria-label": `Delete ${tool.name}`, dataset: { tip: "Delete", key: "delete" }, onclick: this.onDelete }, icon("trash")));
  }

  // ---- questions -------------------------------------------------------------------------------------------------------------

  questions(tool) {
    const { units, up } = tool.questions ?? {};
    const fault = h("p.error-text", { role: "alert" });
    const button = h("button.btn.primary", { type: "submit" }, "Cut it into regions");
    const submit = async (event) => {
      event.preventDefault();
      const answers = Object.fromEntries(new FormData(event.currentTarget));
      button.disabled = true;
      try {
        const changed = await patch(`/tools/${encodeURIComponent(tool.id)}`, answers, this.tool.version);
        this.asked = null;
        this.onChanged(changed);
      } catch (error) {
        fault.textContent = error.message;
        button.disabled = false;
        if (error.status === 412) this.reload();
      }
    };
    return h("div.scroll", {}, h("form.ask-form", { onsubmit: submit }, units ? this.unitChoices(units) : null, up ? this.upChoices(up) : null, fault, button));
  }

  unitChoices(units) {
    return h("fieldset", {}, h("legend", {}, "How large is it?"), units.choices.map((unit) => h("label.choice", {}, h("input", { type: "radio", name: "units", value: unit, required: true, checked: unit === (units.guess ?? "mm") }),
      UNIT_WORDS[unit] ?? unit, h("span.size", {}, sizeIn(unit, units.extents)))));
  }

  upChoices(up) {
    return h("fieldset", {}, h("legend", {}, "Which side is worked on?"), h("p.small.muted", {}, "The direction that points up, towards the hand or the robot."),
      h("div.choices-row", {}, up.choices.map((direction) => h("label.choice", {}, h("input", { type: "radio", name: "up", value: direction, required: true, checked: direction === up.guess }), upWords(direction)))));
  }

  // ---- import and failure ------------------------------------------------------------------------------------------------------

  importing(tool) {
    const words = h("span", {}, tool.job?.message || "Reading the file");
    const bar = h("div.progress", { role: "progressbar", "aria-label": "Import", "aria-valuemin": 0, "aria-valuemax": 100 }, h("i"));
    this.bar = { words, bar };
    return h("div.card-body", {}, h("div.progress-line", { role: "status" }, words, h("span"), bar), h("p.small.muted", { style: { "margin-top": "var(--s-3)" } }, "You can go on with another tool meanwhile."));
  }

  progress(job) {
    if (!this.bar?.bar.isConnected) return;
    const percent = Math.round(job.fraction * 100);
    if (job.message) this.bar.words.textContent = job.message;
    this.bar.bar.style.setProperty("--value", `${percent}%`);
    this.bar.bar.setAttribute("aria-valuenow", percent);
  }

  failed(tool) {
    return h("div.card-body.stack", {}, h("div.note.bad", { role: "alert" }, icon("warn"), h("p", {}, tool.error?.detail ?? "The import failed.")),
      h("p.small.muted", {}, "Nothing was kept of it but this entry. Delete it, or upload a corrected file."), this.report(tool));
  }

  // ---- regions -----------------------------------------------------------------------------------------------------------------

  ready(tool, regions) {
    const table = h("table.region-table", {}, h("thead", {}, h("tr", {}, h("th", {}, "Region"), h("th", {}, "Where"), h("th.num", { dataset: { tip: "Surface area, cm\u00b2" } }, "cm\u00b2"),
      h("th.num", { dataset: { tip: "Highest point: 0 is the lowest of the working surface, 1 the highest" } }, "Height"), h("th.num", { dataset: { tip: "Strongest curvature, 1/m; positive is convex" } }, "1/m"))),
    h("tbody", {}, regions.map((region) => this.row(tool, region))));
    table.addEventListener("pointerleave", () => this.onHighlight(null));
    return [h("div.scroll.table-wrap", {}, table), this.report(tool), tool.kind === "table" ? null : this.cutAgain(tool)];
  }

  row(tool, region) {
    const name = renameable(region.name, "region", async (wanted) => {
      await patch(`/tools/${encodeURIComponent(tool.id)}/regions/${region.id}`, { name: wanted });
      region.name = wanted;
      this.reload();
    });
    return h("tr", { tabindex: "0", dataset: { region: region.id, key: `region-${region.id}` }, onpointerenter: () => this.onHighlight(region.id), onfocus: () => this.onHighlight(region.id), onclick: () => this.onHighlight(region.id) },
      h("td.nowrap", {}, h("span.swatch.pastel", { style: { "--swatch": tint(region.id) } }), name), h("td.words", { onpointerenter: tipWhenCut }, region.description),
      h("td.num", {}, fixed(region.area_mm2 / 100)), h("td.num", {}, fixed(region.height, 2)), h("td.num", {}, fixed(region.curvature_per_m)));
  }

  mark(region, scroll = false) {
    for (const row of this.node.querySelectorAll("tr[data-region]")) {
      const chosen = Number(row.dataset.region) === region && region !== null;
      row.setAttribute("aria-selected", String(chosen));
      if (chosen && scroll) row.scrollIntoView({ block: "nearest" });
    }
  }

  report(tool) {
    if (!tool.report.length) return null;
    const warnings = tool.report.filter((line) => line.level === "warning").length;
    const words = warnings ? plural(warnings, "thing to look at", "things to look at") : plural(tool.report.length, "line");
    return h("details.drawer", { style: { "border-top": "1px solid var(--line)" } }, h("summary", {}, icon("right", "caret"), h("h2", {}, "How it was read"), h("span", { style: { "margin-left": "auto" } }, words)),
      h("ul.report", {}, tool.report.map((line) => h("li", {}, icon(...(LEVELS[line.level] ?? LEVELS.info)), h("span", {}, line.text)))));
  }

  cutAgain(tool) {
    const field = h("input.field", { type: "number", min: "1", max: "200", step: "1", value: tool.region_count ?? "", "aria-label": "Number of regions", dataset: { key: "target" } });
    const fault = h("span.error-text", { role: "alert" });
    const cut = async (event) => {
      event.preventDefault();
      fault.textContent = "";
      const target = field.value === "" ? null : Number(field.value);
      if (target !== null && !(Number.isInteger(target) && target >= 1 && target <= 200)) {
        field.setAttribute("aria-invalid", "true");
        fault.textContent = "Between 1 and 200 regions, or empty to let the surface decide.";
        return;
      }
      try {
        this.onChanged(await post(`/tools/${encodeURIComponent(tool.id)}/segmentations`, target === null ? {} : { target }));
      } catch (error) {
        fault.textContent = error.message;
      }
    };
    return h("form.cut-row", { onsubmit: cut, novalidate: true }, h("label", {}, "Regions"), field, h("button.btn.small", { type: "submit", dataset: { tip: "Saved demonstrations keep the cut they were recorded on" } }, "Cut again"), fault);
  }
}
