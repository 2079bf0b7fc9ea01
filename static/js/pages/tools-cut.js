// How finely the tool is cut: one slider from few to many regions that answers while it moves, two presets, the rest behind "More".

import { post } from "../api.js";
import { fill, h } from "../dom.js";
import { icon } from "../icons.js";
import { plural } from "../words.js";

const PAUSE_MS = 1500; // between arrow keys of one way along the slider

const FIELDS = [
  { key: "tolerance", words: "Fit error allowed", unit: "% of its size", share: 100, usual: 0.1, tip: "How far a region may bend away from a plane, cylinder, cone or sphere" },
  { key: "minimum_area", words: "Smallest region", unit: "% of the area", share: 100, usual: 2, tip: "Smaller ones go to their neighbour" },
];
const SWITCHES = [
  { key: "denoise", words: "It is a scan: smooth the noise first", tip: "Blurs the edges of clean CAD" },
  { key: "absorb_fillets", words: "Give narrow roundings to their neighbours", tip: "A rounding between two larger regions is shared by them" },
];

export class CutPanel {
  // onTool(tool): answered at once or under way.
  constructor({ editor, onTool }) {
    this.editor = editor;
    this.onTool = onTool;
    this.tool = null;
    this.wanted = null;
    this.sending = false;
    this.made = ""; // the cut this drag made last, which the next one replaces
    this.keyAt = 0;
    this.slider = h("input", { type: "range", step: "1", "aria-label": "Number of regions", dataset: { key: "few-many" }, oninput: () => this.slide(), onpointerdown: () => this.begin(), onblur: () => this.begin(), onkeydown: () => this.key() });
    this.value = h("output.num");
    this.presets = h("div.presets");
    this.fault = h("p.error-text", { role: "alert" });
    this.more = this.form();
    this.opener = h("button.more-open", { type: "button", "aria-expanded": "false", "aria-controls": "cut-more", onclick: () => this.open(this.more.hidden) }, "More", icon("right", "caret"));
    this.node = h("section.cut-panel", { "aria-label": "How finely it is cut" }, h("div.few-many", {}, h("span", {}, "Few"), this.slider, h("span", {}, "Many"), this.value, this.opener), this.presets, this.more, this.fault);
  }

  show(tool) {
    const other = tool.id !== this.tool?.id;
    this.tool = tool;
    const { least, most } = tool.edit?.slider ?? { least: 1, most: 1 };
    this.node.hidden = !tool.edit?.slider;
    this.slider.min = String(least);
    this.slider.max = String(Math.max(most, tool.region_count));
    this.slider.disabled = !tool.edit?.editable;
    this.slider.dataset.tip = tool.edit?.why_not ?? "";
    if (other) {
      this.sending = false;
      this.wanted = null;
      this.fault.textContent = "";
      this.open(false);
    }
    if (!this.sending && this.wanted === null) this.say(tool.region_count);
    this.drawPresets();
  }

  say(count) {
    this.slider.value = String(count);
    this.told(count);
  }

  told(count) {
    this.value.textContent = String(count);
    this.slider.setAttribute("aria-valuetext", plural(count, "region"));
  }

  open(wanted) {
    this.more.hidden = !wanted;
    this.opener.setAttribute("aria-expanded", String(wanted));
  }

  drawPresets() {
    const off = !this.tool.edit?.editable;
    const preset = (words, key, params, tip) => h("button.btn.small", { type: "button", disabled: off, dataset: { key, tip }, onclick: () => this.order(params) }, words);
    fill(this.presets, preset("Paper-like: 6\u201314 regions", "paper-like", { preset: "paper-like" }, "Similar patches in rows, as on the layup tools of the study"),
      preset("As built", "default", {}, "The faces of the CAD file, or the planes, cylinders and spheres found in the mesh"));
  }

  form() {
    const field = (entry) => h("label", {}, h("span", { dataset: { tip: entry.tip } }, entry.words), h("span.with-unit", {}, h("input.field", { type: "number", min: "0", max: "100", step: "any", name: entry.key, placeholder: String(entry.usual) }), entry.unit));
    const box = (entry) => h("label.check", { dataset: { tip: entry.tip } }, h("input", { type: "checkbox", name: entry.key }), entry.words);
    return h("form.more-form#cut-more", { novalidate: true, hidden: true, onsubmit: (event) => {
      event.preventDefault();
      this.cutAgain(event.currentTarget);
    } }, FIELDS.map(field), SWITCHES.map(box), h("button.btn.small", { type: "submit", dataset: { tip: "Recorded orders keep the cut they were recorded on" } }, "Cut again"));
  }

  cutAgain(form) {
    const params = {};
    for (const { key, words, share } of FIELDS) {
      const { value } = form.elements[key];
      if (value === "") continue;
      if (!(Number(value) > 0 && Number(value) < 100)) {
        this.fault.textContent = `${words}: more than 0 and less than 100 %, or empty for the usual value.`;
        form.elements[key].setAttribute("aria-invalid", "true");
        return;
      }
      form.elements[key].removeAttribute("aria-invalid");
      params[key] = Number(value) / share;
    }
    for (const { key } of SWITCHES) if (form.elements[key].checked) params[key] = true;
    this.order(params);
  }

  order(params) {
    this.editor.inTurn(async () => {
      this.fault.textContent = "";
      try {
        await this.onTool(await post(this.address, params));
      } catch (error) {
        this.fault.textContent = error.message;
      }
    });
  }

  get address() {
    return `/tools/${encodeURIComponent(this.tool.id)}/segmentations`;
  }

  // Everything from a press of the pointer to the next one, or of arrow keys in a row, is one step of the history.
  begin() {
    this.made = "";
  }

  key() {
    const now = performance.now();
    if (now - this.keyAt > PAUSE_MS) this.begin();
    this.keyAt = now;
  }

  slide() {
    this.wanted = Number(this.slider.value);
    this.told(this.wanted);
    if (this.sending) return;
    this.sending = true;
    this.editor.inTurn(() => this.send());
  }

  // Only the latest wish is sent; the answer may be the nearest number the surface allows.
  async send() {
    const shown = this.tool.id;
    this.fault.textContent = "";
    try {
      while (this.wanted !== null) await this.onTool(await this.cutIntoLatest());
    } catch (error) {
      this.fault.textContent = error.message;
    }
    if (this.tool.id !== shown) return;
    this.wanted = null;
    this.sending = false;
    this.say(this.tool.region_count);
  }

  async cutIntoLatest() {
    let tool = this.tool;
    while (this.wanted !== null) {
      const target = this.wanted;
      this.wanted = null;
      tool = await this.cutInto(target, tool);
    }
    return tool;
  }

  async cutInto(target, before) {
    const now = before.edit.slider.now;
    const tool = await post(this.address, now ? { target, now, continues: before.segmentation_id === this.made } : { target });
    this.made = tool.segmentation_id;
    return tool;
  }
}
