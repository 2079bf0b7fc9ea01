// A sequence as a row of letters: `strip(sequence, regions, { step, differs })`. With `differs`, the regions that differ are
// outlined and coloured and the others are quiet; without, all are coloured. Regions after `step` are faded.

import { h } from "./dom.js";
import { sequenceStyle } from "./ramp.js";

export function strip(sequence, regions, { step = sequence.length, differs = null, named = [] } = {}) {
  const n = sequence.length;
  const letters = sequence.map((id, index) => {
    const region = regions[id] ?? { name: String(id), description: "" };
    const marked = differs === null || differs.includes(id);
    const kind = differs === null ? (named.includes(id) ? ".differs" : "") : marked ? ".differs" : ".same";
    const tip = [`Step ${index + 1}: ${region.name}`, region.description].filter(Boolean).join(", ");
    return h(`span${kind}${index >= step ? ".ahead" : ""}`, { role: "listitem", dataset: { tip }, style: marked ? sequenceStyle(index, n) : {} }, region.name);
  });
  return h(`div.strip${n > 16 ? ".dense" : ""}`, { role: "list", "aria-label": sequence.map((id) => regions[id]?.name ?? id).join(" ") }, letters);
}
