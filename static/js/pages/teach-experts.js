// Several experts: whose orders the next run learns from, and how alike they work, tool by tool. With one expert there is nothing
// to choose and nothing is shown.

import { all, get } from "../api.js";
import { fill, h } from "../dom.js";
import { icon } from "../icons.js";
import { strip } from "../strip.js";
import { number, plural } from "../words.js";

const FEW = 8; // rows shown before "show all"

export async function readExperts(projectId) {
  const report = await get(`/projects/${encodeURIComponent(projectId)}/experts`);
  return report.experts.length > 1 ? new Experts(report) : null;
}

function verdict(row) {
  if (!row.differs.length) return ["check", "the same order"];
  if (row.just_as_good) return ["check", "another order, just as good to both"];
  const words = row.extra === null ? "differs" : `differs: costs up to ${number(100 * row.extra, 2)} % more to one of them`;
  return ["warn", row.recorded ? words : `expected to differ, by what each has taught (${number(100 * row.extra, 2)} %)`];
}

class Experts {
  constructor(report) {
    this.report = report;
    this.regions = new Map();
    this.everything = false;
    this.row = report.tools.find((row) => row.differs.length) ?? report.tools[0] ?? null;
    this.boxes = report.experts.map((expert) => h("input", { type: "checkbox", checked: this.preset(expert), dataset: { key: `author-${expert.name}` }, value: expert.name }));
    this.detail = h("div.experts-detail", { "aria-live": "polite" });
    this.list = h("div.experts-list");
    this.choice = h("fieldset.whose", {}, h("legend.small.muted", {}, "Whose orders"), report.experts.map((expert, k) => h("label.check", {}, this.boxes[k], `${expert.name} (${plural(expert.demonstrations.length, "order")})`)));
    this.node = h("section.card.experts", { "aria-label": "Experts side by side" }, h("div.card-head", {}, h("h2", {}, "Experts side by side")),
      h(`div.note${report.pooling.safe === false ? ".warn" : ""}`, {}, icon(report.pooling.safe === false ? "warn" : report.pooling.safe ? "check" : "info"), h("p", {}, report.pooling.text)),
      report.pairs.map((pair) => h("p.small.muted", {}, pair.text)), this.again(), h("div.experts-body", {}, this.list, this.detail));
    this.paint();
  }

  // All of them where that is safe; else whoever has recorded most.
  preset(expert) {
    const { pooling, experts } = this.report;
    const most = experts.reduce((best, other) => (other.demonstrations.length > best.demonstrations.length ? other : best));
    return pooling.safe === false ? expert === most : true;
  }

  again() {
    return this.report.experts.filter((expert) => expert.orders_again).map((expert) => h("p.small.muted", { dataset: { tip: "How consistently somebody works: agreement of an order with the one it replaced, 1 is the same order" } },
      `${expert.name} recorded ${plural(expert.orders_again, "order")} again: agreement ${number(expert.orders_agreement, 2)} with the earlier ${expert.orders_again === 1 ? "one" : "ones"}.`));
  }

  chosen() {
    return this.boxes.filter((box) => box.checked).map((box) => box.value);
  }

  paint() {
    const { tools } = this.report;
    const shown = this.everything ? tools : tools.slice(0, FEW);
    fill(this.list, shown.map((row) => {
      const [mark, words] = verdict(row);
      const key = `${row.tool_id}-${row.first.author}-${row.second.author}`;
      return h("button", { type: "button", dataset: { key }, "aria-pressed": String(row === this.row), onclick: () => this.open(row) }, h("b.strong", {}, row.tool_name), h("span.num", { dataset: { tip: "Agreement of the two orders: 1 the same, 0 unrelated, -1 backwards" } }, number(row.agreement, 2)),
        h("span.small.muted", {}, icon(mark), ` ${row.first.author} and ${row.second.author}: ${words}`));
    }), shown.length < tools.length ? h("button", { type: "button", dataset: { key: "all-rows" }, onclick: () => {
      this.everything = true;
      this.paint();
    } }, `Show all ${tools.length}`) : null);
    this.paintDetail();
  }

  open(row) {
    this.row = row;
    this.paint();
  }

  async paintDetail() {
    const { row } = this;
    if (!row) return fill(this.detail, h("p.empty-words.small", {}, "Once both have recorded the same tool, their orders are shown here side by side."));
    if (!this.regions.has(row.tool_id)) this.regions.set(row.tool_id, (await all(`/tools/${encodeURIComponent(row.tool_id)}/regions`)).sort((a, b) => a.id - b.id));
    if (row !== this.row) return undefined;
    const side = (one, other) => h("figure", {}, h("figcaption", {}, h("b", {}, one.author)), h("img", { alt: `${row.tool_name} with its regions numbered in the order of ${one.author}`, src: `/api/v1/tools/${encodeURIComponent(row.tool_id)}/picture.svg?sequence=${one.sequence.join(",")}&beside=${other.sequence.join(",")}` }),
      strip(one.sequence, this.regions.get(row.tool_id), { differs: row.differs }));
    return fill(this.detail, h("p", {}, row.text), h("div.experts-pair", {}, side(row.first, row.second), side(row.second, row.first)));
  }
}
