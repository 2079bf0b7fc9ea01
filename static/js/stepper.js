// The slider that walks along a sequence: play button, coloured bands, "after step 4 of 12". Space plays, arrows step.
//
//   const stepper = new Stepper({ n: 12, onStep: (k) => ... });     // k regions are done, 0..n
//   host.append(stepper.node);   stepper.set(4);   stepper.play();   stepper.speed = 2;

import { fill, h } from "./dom.js";
import { icon } from "./icons.js";
import { bind } from "./keys.js";
import { rampColour } from "./ramp.js";

const STEP_MS = 700;

export class Stepper {
  constructor({ n, step = n, onStep, name = "Play", when = () => true }) {
    this.n = n;
    this.step = step;
    this.onStep = onStep;
    this.speed = 1;
    this.timer = null;
    this.button = h("button.icon-btn", { type: "button", style: { "margin-left": "-8px" }, onclick: () => this.toggle() });
    this.bands = h("div.bands");
    this.slider = h("input", { type: "range", min: "0", max: String(n), step: "1", value: String(step), "aria-label": "Step", oninput: () => {
      this.pause();
      this.set(Number(this.slider.value));
    } });
    this.at = h("span.at");
    this.name = name;
    this.node = h("div.scrubber", { role: "group", "aria-label": name }, this.button, h("div.track", {}, this.bands, this.slider), this.at);
    this.unbind = [
      bind({ key: " ", shown: "Space", name: `${name} or pause`, when, run: () => this.toggle() }),
      bind({ key: "ArrowLeft", shown: "←", name: "One step back", when, run: () => this.move(-1) }),
      bind({ key: "ArrowRight", shown: "→", name: "One step on", when, run: () => this.move(1) }),
    ];
    addEventListener("themechange", () => this.draw());
    this.draw();
  }

  get playing() {
    return this.timer !== null;
  }

  // A new sequence takes the place of the old one.
  reset(n, step = n) {
    this.pause();
    this.n = n;
    this.slider.max = String(n);
    this.step = Math.min(step, n);
    this.draw();
  }

  set(step) {
    const bounded = Math.max(0, Math.min(this.n, step));
    if (bounded === this.step) return;
    this.step = bounded;
    this.draw();
    this.onStep(bounded);
  }

  move(by) {
    this.pause();
    this.set(this.step + by);
  }

  toggle() {
    if (this.playing) this.pause();
    else this.play();
  }

  play() {
    if (this.step >= this.n) this.set(0);
    this.timer = setInterval(() => {
      this.set(this.step + 1);
      if (this.step >= this.n) this.pause();
    }, STEP_MS / this.speed);
    this.draw();
  }

  pause() {
    clearInterval(this.timer);
    this.timer = null;
    this.draw();
  }

  close() {
    this.pause();
    for (const unbind of this.unbind) unbind();
  }

  draw() {
    const words = this.playing ? "Pause" : this.name;
    this.button.setAttribute("aria-label", words);
    this.button.dataset.tip = `${words} (space)`;
    this.button.replaceChildren(icon(this.playing ? "pause" : "play"));
    fill(this.bands, Array.from({ length: this.n }, (_, i) => (i < this.step ? h("i", { style: { "--seq": rampColour(i, this.n) } }) : h("i.ahead"))));
    this.slider.value = String(this.step);
    const where = this.step === 0 ? "before the start" : `after step ${this.step} of ${this.n}`;
    this.slider.setAttribute("aria-valuetext", where);
    this.at.textContent = where;
  }
}
