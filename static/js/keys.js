// The keyboard. A page says `bind({ key: "z", ctrl: true, name: "Undo", run })`; the `?` dialog lists what is bound.
// Keys never act while a field has the focus, and Space and Enter stay with a focused button. `adopt(window)` lets the same
// keys work while the 3D view inside its frame has the focus.

import { h } from "./dom.js";

const bindings = [];

const shownKey = (key, ctrl) => `${ctrl ? "Ctrl " : ""}${key.length === 1 ? key.toUpperCase() : key}`;

// key: event.key or a test (key) => boolean; shown: what the help prints; when: () => boolean.
export function bind({ key, ctrl = false, shift = null, alt = false, name, shown, when = () => true, run }) {
  const entry = { key, ctrl, shift, alt, name, shown: shown ?? shownKey(String(key), ctrl), when, run };
  bindings.push(entry);
  return () => bindings.splice(bindings.indexOf(entry), 1);
}

function inField(target) {
  if (!target?.matches) return false;
  if (target.isContentEditable || target.matches("textarea, select")) return true;
  return target.matches("input") && !["range", "checkbox", "radio", "button"].includes(target.type);
}

const pressable = (target) => Boolean(target?.matches?.("button, a[href], summary, input"));
const steering = (target) => Boolean(target?.matches?.("input[type=range], [role=menuitem]"));

function fits(entry, event) {
  if (entry.ctrl !== (event.ctrlKey || event.metaKey) || entry.alt !== event.altKey) return false;
  if (entry.shift !== null && entry.shift !== event.shiftKey) return false;
  const key = event.key.length === 1 ? event.key.toLowerCase() : event.key;
  return (typeof entry.key === "function" ? entry.key(key) : entry.key === key) && entry.when();
}

// True when a binding took the key.
function dispatch(event) {
  if (event.defaultPrevented || inField(event.target) || document.querySelector("dialog[open]")) return false;
  if ((event.key === " " || event.key === "Enter") && pressable(event.target)) return false;
  if (event.key.startsWith("Arrow") && (steering(event.target) || event.altKey)) return false;
  const entry = bindings.find((candidate) => fits(candidate, event));
  if (!entry) return false;
  event.preventDefault();
  entry.run(event);
  return true;
}

export function startKeys() {
  addEventListener("keydown", dispatch);
}

export function adopt(frame) {
  frame.addEventListener("keydown", (event) => dispatch(event) && event.stopImmediatePropagation(), true);
}

export function showKeys() {
  document.querySelector("dialog.keys")?.remove();
  const rows = bindings.filter((entry) => entry.name).map((entry) => h("div.key-row", {}, h("dt", {}, entry.shown.split(" ").map((part) => (/^(to|or)$/.test(part) ? ` ${part} ` : h("kbd", {}, part)))), h("dd", {}, entry.name)));
  const dialog = h("dialog.keys.card.pad", { "aria-labelledby": "keys-title" },
    h("h2#keys-title", {}, "Keys on this page"), h("dl", {}, rows),
    h("form", { method: "dialog" }, h("button.btn", { autofocus: true }, "Close")));
  dialog.addEventListener("click", (event) => event.target === dialog && dialog.close());
  document.body.append(dialog);
  dialog.showModal();
}
