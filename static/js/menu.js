// A button that opens a list of links or actions: `menuButton("Trough 10", () => [{ label, note, href | run, current }])`.
// Arrow keys move, Escape closes and gives the focus back.

import { fill, h } from "./dom.js";
import { icon } from "./icons.js";

function entry(item, close) {
  const inside = [h("span", {}, item.label), item.note ? h("span.note-text", {}, item.note) : null];
  const common = { role: "menuitem", tabindex: "-1", "aria-current": item.current ? "true" : null };
  if (item.href) return h("a", { ...common, href: item.href }, inside);
  return h("button", { ...common, type: "button", onclick: () => {
    close();
    item.run();
  } }, inside);
}

export function menuButton(label, items, selector = "button", { name = null } = {}) {
  const list = h("div.menu.card", { role: "menu", hidden: true });
  const button = h(selector, { type: "button", "aria-haspopup": "menu", "aria-expanded": "false", "aria-label": name }, label, icon("down"));
  const wrap = h("span.menu-wrap", {}, button, list);
  const entries = () => [...list.querySelectorAll("[role=menuitem]")];
  const close = () => {
    list.hidden = true;
    button.setAttribute("aria-expanded", "false");
  };
  const open = () => {
    fill(list, items().map((item) => entry(item, () => {
      close();
      button.focus();
    })));
    list.hidden = false;
    button.setAttribute("aria-expanded", "true");
    const box = button.getBoundingClientRect();
    list.style.left = `${Math.max(8, Math.min(box.left, innerWidth - list.offsetWidth - 8))}px`;
    list.style.top = `${box.bottom + 4}px`;
    (list.querySelector("[aria-current]") ?? entries()[0])?.focus();
  };
  button.addEventListener("click", () => (list.hidden ? open() : close()));
  wrap.addEventListener("keydown", (event) => {
    if (list.hidden) return;
    const all = entries();
    const at = all.indexOf(document.activeElement);
    const step = { ArrowDown: 1, ArrowUp: -1 }[event.key];
    if (step) all[(at + step + all.length) % all.length]?.focus();
    else if (event.key === "Escape") {
      close();
      button.focus();
    } else return;
    event.preventDefault();
  });
  wrap.addEventListener("focusout", (event) => !wrap.contains(event.relatedTarget) && close());
  addEventListener("pointerdown", (event) => !wrap.contains(event.target) && close());
  return wrap;
}
