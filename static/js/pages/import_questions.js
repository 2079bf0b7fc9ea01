// What an import asks: how large the part is and which side is worked on.
//
//   importQuestions(tool, { onChanged(tool), reload() })  a form; its answer goes to the server and the changed tool to onChanged

import { patch } from "../api.js";
import { h } from "../dom.js";
import { number } from "../words.js";

const METRES = { mm: 0.001, cm: 0.01, m: 1, in: 0.0254 };
const UNIT_WORDS = { mm: "Millimetres", cm: "Centimetres", m: "Metres", in: "Inches" };

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

function unitChoices(units) {
  return h("fieldset", {}, h("legend", {}, "How large is it?"), units.choices.map((unit) => h("label.choice", {}, h("input", { type: "radio", name: "units", value: unit, required: true, checked: unit === (units.guess ?? "mm") }),
    UNIT_WORDS[unit] ?? unit, h("span.size", {}, sizeIn(unit, units.extents)))));
}

function upChoices(up) {
  return h("fieldset", {}, h("legend", {}, "Which side is worked on?"), h("p.small.muted", {}, "The direction that points up, towards the hand or the robot."),
    h("div.choices-row", {}, up.choices.map((direction) => h("label.choice", {}, h("input", { type: "radio", name: "up", value: direction, required: true, checked: direction === up.guess }), upWords(direction)))));
}

export function importQuestions(tool, { onChanged, reload }) {
  const { units, up } = tool.questions ?? {};
  const fault = h("p.error-text", { role: "alert" });
  const button = h("button.btn.primary", { type: "submit" }, "Cut it into regions");
  const submit = async (event) => {
    event.preventDefault();
    button.disabled = true;
    try {
      onChanged(await patch(`/tools/${encodeURIComponent(tool.id)}`, Object.fromEntries(new FormData(event.currentTarget)), tool.version));
    } catch (error) {
      fault.textContent = error.message;
      button.disabled = false;
      if (error.status === 412) reload();
    }
  };
  return h("form.ask-form", { onsubmit: submit }, units ? unitChoices(units) : null, up ? upChoices(up) : null, fault, button);
}

// What stands below the list of tools: which files can be dropped here.
export function uploadExtras() {
  return h("p.drop-note", {}, "Drop CAD files or region tables anywhere on this page.");
}
