// One question: two orders side by side in 3D, walked through together, and the answers with their keys.

import { fill, h } from "../dom.js";
import { icon } from "../icons.js";
import { bind } from "../keys.js";
import { Stepper } from "../stepper.js";
import { strip } from "../strip.js";
import { View3D } from "../view3d.js";
import { QuestionFile } from "./teach-file.js";

const WIDE = "(min-width: 1100px)";
const MOST_TICKS = 24;

// A note that holds for both orders stands beside the tool's name, so that it covers nothing.
const sharedNote = ({ left, right }) => left.note === right.note;

export class QuestionView {
  constructor({ projectId, regionsOf, onAnswer, onUndo, canUndo, onFile }) {
    this.projectId = projectId;
    this.regionsOf = regionsOf;
    this.onAnswer = onAnswer;
    this.onUndo = onUndo;
    this.canUndo = canUndo;
    this.file = new QuestionFile({ onRead: onFile });
    this.query = null;
    this.chosen = "left";
    this.wide = matchMedia(WIDE);
    this.top = h("div.top");
    this.sides = { left: this.side("left"), right: this.side("right") };
    this.switch = h("div.segmented", { role: "group", "aria-label": "Which order is shown", style: { "justify-self": "start" } });
    this.pair = h("div.pair", {}, this.sides.left.node, this.sides.right.node);
    this.answers = h("div.answers", { role: "group", "aria-labelledby": "question-title" });
    this.below = h("div.below");
    this.stepper = new Stepper({ n: 1, name: "Play both", onStep: () => this.paint(), when: () => this.active });
    this.nodes = [this.top, this.switch, this.pair, this.stepper.node, this.answers, this.below];
    this.wide.addEventListener("change", () => this.arrange());
    addEventListener("themechange", () => this.query && this.paint());
    this.bindKeys();
  }

  get active() {
    return this.query !== null && this.pair.isConnected;
  }

  bindKeys() {
    bind({ key: (key) => this.active && this.query.choices.some((choice) => choice.key === key), shown: "1 2 3 4 5 0", name: "Answer the question", when: () => this.active, run: (event) => this.answer(this.query.choices.find((choice) => choice.key === event.key)) });
    bind({ key: "u", name: "Undo the last answer", when: () => this.canUndo(), run: () => this.onUndo() });
    bind({ key: "z", ctrl: true, shift: false, name: "Undo the last answer", when: () => this.canUndo(), run: () => this.onUndo() });
    bind({ key: "v", name: "Show the other order (narrow window)", when: () => this.active && !this.wide.matches, run: () => this.choose(this.chosen === "left" ? "right" : "left") });
  }

  side(which) {
    const label = h("span");
    const note = h("small");
    const stage = h("div.stage", {}, h("div.tl", {}, h("span.plate", {}, label, " ", note)));
    const letters = h("div");
    const node = h("section.side", { "aria-label": which === "left" ? "Left order" : "Right order" }, stage, letters);
    return { which, label, note, stage, letters, node, view: null };
  }

  // One view in a narrow window, two in a wide one; the second is opened only when it is needed.
  arrange() {
    const wide = this.wide.matches;
    this.pair.classList.toggle("one", !wide);
    this.switch.hidden = wide;
    this.sides.left.view ??= new View3D(this.sides.left.stage, { projectId: this.projectId, name: "teach-left" });
    if (wide) this.sides.right.view ??= new View3D(this.sides.right.stage, { projectId: this.projectId, name: "teach-right" });
    for (const side of Object.values(this.sides)) side.node.classList.toggle("chosen", wide || side.which === "left");
    if (this.query) this.paint();
  }

  choose(which) {
    this.chosen = which;
    this.paint();
  }

  show(query) {
    const same = this.query?.id === query.id;
    this.query = query;
    this.busy = false;
    if (!same) {
      this.chosen = "left";
      this.stepper.reset(query.left.sequence.length);
    }
    this.arrange();
    this.paintWords();
  }

  hide() {
    this.query = null;
    this.stepper.pause();
  }

  async answer(choice) {
    if (!choice || this.busy || !this.query) return;
    this.busy = true;
    this.stepper.pause();
    for (const button of this.answers.children) button.disabled = true;
    await this.onAnswer(this.query, choice);
    this.busy = false;
    for (const button of this.answers.children) button.disabled = false;
  }

  paintWords() {
    const { query } = this;
    const [answered, of] = [query.number - 1, Math.max(query.of, query.number)];
    const more = of - query.number;
    const ticks = of <= MOST_TICKS ? h("span.steps", { role: "img", "aria-label": `${answered} answered, ${more + 1} left` }, Array.from({ length: of }, (_, i) => h(`i${i < answered ? ".done" : i === answered ? ".now" : ""}`))) : null;
    fill(this.top, h("div.question", { "aria-live": "polite" }, h("h1#question-title", {}, query.title), h("p.muted", {}, h("b.strong", {}, sharedNote(query) ? `${query.tool_name}, ${query.left.note}` : query.tool_name), ". ", query.difference)),
      h("div.count", {}, h("span.num", {}, `Question ${query.number}${more ? `, ${more} more` : ", the last for now"}`), ticks));
    this.answers.style.setProperty("--columns", ["1fr", "1fr", ...query.choices.slice(2).map(() => "auto")].join(" "));
    fill(this.answers, query.choices.map((choice) => h(`button.answer${["cant_tell", "equal", "both_wrong"].includes(choice.value) ? ".quiet" : ""}`, { type: "button", dataset: { key: `answer-${choice.value}`, value: choice.value }, onclick: () => this.answer(choice) },
      h("kbd", {}, choice.key), h("span", {}, h("b", {}, choice.label), choice.hint ? h("small", {}, choice.hint) : null))));
    fill(this.below, query.why ? h("p.why", {}, h("b", {}, "Why this one"), query.why) : null, h("span.push"), this.file.menu(query.run_id),
      h("button.btn.quiet.small", { type: "button", disabled: !this.canUndo(), dataset: { key: "undo-answer", tip: "Undo last answer (U)" }, onclick: () => this.onUndo() }, icon("undo"), "Undo last answer"));
  }

  paint() {
    const { query } = this;
    const regions = this.regionsOf(query.tool_id);
    const step = this.stepper.step;
    const wide = this.wide.matches;
    const few = query.marked.length === query.differs.length; // the rest stays in the background; else only what the sentence names is outlined
    for (const side of Object.values(this.sides)) {
      const entry = query[side.which];
      fill(side.letters, strip(entry.sequence, regions, { step, ...(few ? { differs: query.marked } : { named: query.marked }) }));
      const shown = wide ? entry : query[this.chosen];
      side.label.textContent = shown.label;
      side.note.textContent = sharedNote(query) ? "" : shown.note;
      if (!wide && side.which === "right") continue;
      const names = query.differs.map((id) => regions[id]?.name ?? id).join(", ");
      side.view?.show({ mode: "sequence", tool_id: query.tool_id, sequence: shown.sequence, step: step === this.stepper.n ? null : step, ...(few ? { differs: query.marked } : { highlight: query.marked }) }, `${query.tool_name}, order “${shown.label}”, ${step === this.stepper.n ? "complete" : `after step ${step}`}; ${names} differ`);
    }
    if (!wide) {
      fill(this.switch, ["left", "right"].map((which) => h("button", { type: "button", "aria-pressed": String(this.chosen === which), dataset: { key: `side-${which}` }, onclick: () => this.choose(which) }, query[which].label)));
    }
  }
}
