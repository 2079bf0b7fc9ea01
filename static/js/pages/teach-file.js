// Questions as a file, for an expert who can't come to this page: a table or a page to print, and the answers read back.

import { upload } from "../api.js";
import { fill, h } from "../dom.js";
import { icon } from "../icons.js";
import { menuButton } from "../menu.js";
import { complain, toast } from "../toasts.js";
import { plural } from "../words.js";

export class QuestionFile {
  constructor({ onRead }) {
    this.onRead = onRead;
    this.runId = "";
    this.report = h("div", { role: "status" }); // stays until it is dismissed, whatever the run does meanwhile
    this.input = h("input", { type: "file", accept: ".csv,text/csv", hidden: true, "aria-label": "File with answers", onchange: () => this.read() });
  }

  menu(runId) {
    this.runId = runId;
    const address = `/api/v1/runs/${encodeURIComponent(runId)}`;
    const entries = () => [
      { label: "Download as a table", note: "CSV", href: `${address}/questions.csv` },
      { label: "Page to print", note: "with pictures", run: () => open(`${address}/questions.html`, "_blank", "noopener") },
      { label: "Read answers", note: "CSV", run: () => this.input.click() },
    ];
    return h("span", {}, menuButton("Questions as a file", entries, "button.btn.quiet.small"), this.input);
  }

  async read() {
    const [file] = this.input.files;
    if (!file) return;
    this.input.value = "";
    try {
      const report = await upload(`/runs/${encodeURIComponent(this.runId)}/answers`, { file });
      const count = report.applied.length;
      toast(count ? `${plural(count, "answer")} read from ${file.name}` : `No new answer in ${file.name}`);
      const lines = [...report.faults, ...report.already].sort((a, b) => a.line - b.line);
      const words = `${plural(lines.length, "row")} of ${file.name} ${lines.length === 1 ? "does" : "do"} not count. The other answers are stored.`;
      const dismiss = h("button.btn.quiet.small", { type: "button", dataset: { key: "dismiss-report" }, onclick: () => fill(this.report) }, "Dismiss");
      fill(this.report, lines.length ? h("div.note.warn", {}, icon("warn"), h("div", {}, h("p", {}, words), h("ul", {}, lines.map((row) => h("li", {}, row.text))), dismiss)) : null);
      await this.onRead(report);
    } catch (error) {
      complain(error);
    }
  }
}
