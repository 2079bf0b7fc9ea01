// Uploads of the tools page: files by button or drop, a row per file while it is sent, the reason in words when it is refused.

import { upload } from "../api.js";
import { fill, h } from "../dom.js";
import { icon } from "../icons.js";
import { bytes } from "../words.js";

export const CAD = [".step", ".stp", ".iges", ".igs", ".stl", ".obj", ".ply", ".off", ".glb", ".3mf"];
const TABLE = /\.(csv|json)$/i;

export class Uploads {
  // onDone(tool) runs after each file that was taken.
  constructor({ projectId, onDone }) {
    this.base = `/projects/${encodeURIComponent(projectId)}/tools`;
    this.onDone = onDone;
    this.entries = [];
    this.node = h("div", { role: "status" });
    this.cad = this.chooser("cad-file", CAD.join(","), false);
    this.table = this.chooser("table-file", ".csv,.json,text/csv,application/json", true);
    this.inputs = [this.cad, this.table];
  }

  chooser(id, accept, asTable) {
    const input = h(`input#${id}`, { type: "file", hidden: true, multiple: true, accept, onchange: () => {
      const files = [...input.files];
      input.value = "";
      this.send(files, asTable);
    } });
    return input;
  }

  async send(files, asTable = false) {
    for (const file of files) await this.sendOne(file, asTable || TABLE.test(file.name));
  }

  async sendOne(file, asTable) {
    const entry = { name: file.name, size: file.size, fraction: 0, fault: "" };
    this.entries.push(entry);
    this.draw();
    try {
      const tool = await upload(asTable ? `${this.base}/region-table` : this.base, { file }, (fraction) => {
        entry.fraction = fraction;
        this.draw();
      });
      this.dismiss(entry);
      await this.onDone(tool);
    } catch (error) {
      entry.fault = error.message;
    }
    this.draw();
  }

  dismiss(entry) {
    this.entries = this.entries.filter((other) => other !== entry);
    this.draw();
  }

  draw() {
    fill(this.node, this.entries.map((entry) => (entry.fault ? this.refused(entry) : this.sending(entry))));
  }

  refused(entry) {
    const name = entry.fault.includes(entry.name) ? null : [h("b.strong", {}, entry.name), ": "];
    return h("div.upload-row", {}, h("div.note.bad", { role: "alert" }, icon("warn"), h("span", {}, name, entry.fault)),
      h("button.btn.quiet.small", { type: "button", style: { "justify-self": "start" }, onclick: () => this.dismiss(entry) }, "Dismiss"));
  }

  sending(entry) {
    const percent = Math.round(entry.fraction * 100);
    const words = entry.fraction < 1 ? bytes(entry.size) : "reading it";
    return h("div.upload-row", {}, h("div.progress-line", {}, h("span", {}, entry.name), h("span.muted", {}, words),
      h("div.progress", { role: "progressbar", "aria-label": `Sending ${entry.name}`, "aria-valuemin": 0, "aria-valuemax": 100, "aria-valuenow": percent, style: { "--value": `${percent}%` } }, h("i"))));
  }

  // Files dropped anywhere on the page; `main` is marked while they hover.
  acceptDrops(main) {
    const files = (event) => [...(event.dataTransfer?.types ?? [])].includes("Files");
    let depth = 0;
    const enter = (by) => (event) => {
      if (!files(event)) return;
      depth = Math.max(0, depth + by);
      main.classList.toggle("dropping", depth > 0);
    };
    addEventListener("dragenter", enter(1));
    addEventListener("dragleave", enter(-1));
    addEventListener("dragover", (event) => files(event) && event.preventDefault());
    addEventListener("drop", (event) => {
      if (!files(event)) return;
      event.preventDefault();
      depth = 0;
      main.classList.remove("dropping");
      this.send([...event.dataTransfer.files]);
    });
  }
}
