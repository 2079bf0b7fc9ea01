// What an import asks: which body of the file, how large it is, which side is worked on; and the same later, to correct it.
//
//   importQuestions(tool, { onChanged(tool), reload() })  a form; its answer goes to the server and the changed tool to onChanged
//   readAgain(tool)                                       how the tool was read, to be changed; null for tools without a file
//   uploadExtras()                                        what stands below the list of tools

import { patch } from "../api.js";
import { h } from "../dom.js";
import { icon } from "../icons.js";
import { number, plural } from "../words.js";

const METRES = { mm: 0.001, cm: 0.01, m: 1, in: 0.0254 };
const UNIT_WORDS = { mm: "Millimetres", cm: "Centimetres", m: "Metres", in: "Inches" };
const UPS = ["+x", "-x", "+y", "-y", "+z", "-z"];
const SMALLEST = 0.005; // m; as the server: a part whose longest side is outside is probably in another unit
const LARGEST = 20;
const SAY_UNITS = /\.(step|stp|iges|igs|glb|3mf)$/i; // formats that know how large they are

// "120 x 80 x 32 mm": what the part would measure if the file were written in this unit.
export function sizeIn(unit, extents) {
  const metres = extents.map((length) => length * METRES[unit]);
  const large = Math.max(...metres) >= 1;
  return `${metres.map((length) => number(large ? length : length * 1000)).join(" \u00d7 ")} ${large ? "m" : "mm"}`;
}

// "would be 2.4 km long" where the unit makes the part unbelievably large or small.
export function sizeHint(unit, extents) {
  const longest = Math.max(...extents) * METRES[unit];
  if (longest >= SMALLEST && longest <= LARGEST) return "";
  const words = longest >= 1000 ? `${number(longest / 1000)} km` : longest >= 1 ? `${number(longest)} m` : `${number(longest * 1000)} mm`;
  return `would be ${words} long`;
}

function upWords(direction) {
  const axis = direction[1].toUpperCase();
  return direction[0] === "+" ? `${axis} up` : `${axis} down`;
}

function bodyChoices(body, units, chosen) {
  return h("fieldset.bodies", {}, h("legend", {}, `Which of the ${body.choices.length - 1} bodies is the tool?`),
    h("div.body-list", {}, body.choices.map((choice) => h("label.choice", {}, h("input", { type: "radio", name: "body", value: choice.id, required: true, checked: choice.id === chosen }),
      h("span.body-name", {}, choice.name, h("small.muted", {}, plural(choice.faces, "triangle"))), h("span.size", {}, choice.size ?? sizeIn(units ?? "mm", choice.extents))))));
}

function unitChoices(choices, chosen, extents) {
  return h("fieldset", {}, h("legend", {}, "How large is it?"), choices.map((unit) => {
    const hint = sizeHint(unit, extents);
    return h("label.choice", {}, h("input", { type: "radio", name: "units", value: unit, required: true, checked: unit === chosen }),
      h("span.body-name", {}, UNIT_WORDS[unit] ?? unit, hint ? h("small.unlikely", {}, hint) : null), h("span.size", {}, sizeIn(unit, extents)));
  }));
}

function upChoices(choices, chosen, guess) {
  return h("fieldset", {}, h("legend", {}, "Which side is worked on?"), h("p.small.muted", {}, "The direction that points up, towards the hand or the robot. Choose here, or click an arrow beside the part."),
    h("div.choices-row", {}, choices.map((direction) => h("label.choice", { dataset: direction === guess ? { tip: "Guessed: it lies flat this way" } : {} }, h("input", { type: "radio", name: "up", value: direction, required: true, checked: direction === chosen }),
      upWords(direction)))));
}

// The fieldsets of a form; those of units and direction follow the chosen body until they are answered by hand.
function follow(form, { body, units, up }) {
  form.addEventListener("change", (event) => {
    if (event.target.name !== "body") {
      event.target.closest("fieldset").dataset.answered = "yes";
      return;
    }
    const choice = body.choices.find((entry) => entry.id === event.target.value);
    for (const [index, unit] of (units?.choices ?? []).entries()) {
      const row = form.querySelectorAll('[name="units"]')[index].closest("label");
      row.querySelector(".size").textContent = sizeIn(unit, choice.extents);
      row.querySelector(".unlikely")?.remove();
      const hint = sizeHint(unit, choice.extents);
      if (hint) row.querySelector(".body-name").append(h("small.unlikely", {}, hint));
    }
    const guess = up && form.querySelector(`[name="up"][value="${choice.up_guess}"]`);
    if (guess && !guess.closest("fieldset").dataset.answered) guess.checked = true;
  });
}

function answering(tool, button, fault, { onChanged, reload }) {
  return async (event) => {
    event.preventDefault();
    button.disabled = true;
    fault.textContent = "";
    try {
      onChanged(await patch(`/tools/${encodeURIComponent(tool.id)}`, Object.fromEntries(new FormData(event.currentTarget)), tool.version));
    } catch (error) {
      fault.textContent = error.message;
      button.disabled = false;
      if (error.status === 412) reload();
    }
  };
}

// What would become of the file by the answers given so far, for the 3D view; a body is pointed at by hovering its line.
function looked(form, body, onLook) {
  const look = (event) => {
    const hovered = event.type === "pointerover" ? event.target.closest(".body-list label") : null;
    const at = hovered ? body.choices.findIndex((choice) => choice.id === hovered.querySelector("input").value) : -1;
    const several = hovered && body.choices[at].id === "all";
    onLook({ body: form.elements.body?.value ?? null, up: form.elements.up?.value ?? null, highlight: at < 0 || several ? [] : [at] });
  };
  for (const type of ["change", "pointerover", "pointerleave"]) form.addEventListener(type, look);
}

export function importQuestions(tool, handlers) {
  const { body, units, up } = tool.questions ?? {};
  const fault = h("p.error-text", { role: "alert" });
  const button = h("button.btn.primary", { type: "submit" }, "Cut it into regions");
  const form = h("form.ask-form", { onsubmit: answering(tool, button, fault, handlers) }, body ? bodyChoices(body, tool.units, body.guess) : null,
    units ? unitChoices(units.choices, units.guess ?? "mm", units.extents) : null, up ? upChoices(up.choices, up.guess, up.guess) : null, fault, button);
  follow(form, { body, units, up });
  looked(form, body, handlers.onLook);
  return form;
}

// Corrects what was answered, or guessed, at the import. The server tells the page about the changed tool by an event.
export function readAgain(tool) {
  if (tool.kind !== "cad" || tool.state !== "ready" || !tool.bodies?.length) return null;
  const fault = h("p.error-text", { role: "alert" });
  const button = h("button.btn", { type: "submit" }, "Read it again");
  const several = tool.bodies.length > 1;
  const whole = { id: "all", name: `All ${tool.bodies.length} bodies`, extents: tool.bodies[0].extents, faces: tool.bodies.reduce((sum, entry) => sum + entry.faces, 0), size: "" };
  const body = { choices: [...tool.bodies, whole] };
  const chosen = tool.bodies.find((entry) => entry.id === tool.body) ?? tool.bodies[0];
  const form = h("form.ask-form", { onsubmit: answering(tool, button, fault, { onChanged: () => {}, reload: () => {} }) }, several ? bodyChoices(body, tool.units, tool.body) : null,
    SAY_UNITS.test(tool.file_name ?? "") ? null : unitChoices(Object.keys(METRES), tool.units, chosen.extents), upChoices(UPS, tool.up, chosen.up_guess),
    h("p.small.muted", {}, "It is cut into regions anew; what was recorded stays with the cut it was recorded on."), fault, button);
  return h("details.more.pad-x.read-again", {}, h("summary", { dataset: { key: "read-again" } }, icon("right", "caret"), several ? "Another body, size or direction" : "Another size or direction"), form);
}

// What stands below the list of tools: which files can be dropped here, and tables to start from.
export function uploadExtras() {
  const template = (format) => h("a", { href: `/api/v1/region-table-template?format=${format}`, download: `region-table.${format}`, dataset: { key: `template-${format}` } }, format.toUpperCase());
  return h("p.drop-note", {}, h("span", {}, "Drop CAD files or region tables anywhere on this page. A table to start from: ", template("csv"), " or ", template("json"), "."));
}
