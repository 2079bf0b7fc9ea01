// How a file was read, in groups: what to look at first, what was repaired, what was left out, what is as it should be.

import { h } from "../dom.js";
import { icon } from "../icons.js";

const GROUPS = [
  ["warning", "Look at this", "warn", "warn"],
  ["repaired", "Repaired", "check", "ok"],
  ["refused", "Left out", "info", ""],
  ["info", "As it is", "info", ""],
];

export function reportList(lines) {
  return GROUPS.map(([level, title, name, tone]) => {
    const mine = lines.filter((line) => line.level === level);
    return mine.length ? h("section.report-group", { dataset: { level } }, h("h4", {}, title), h("ul.report", {}, mine.map((line) => h("li", {}, icon(name, tone), h("span", {}, line.text))))) : null;
  });
}
