// Short messages at the lower edge: `toast("Trough 10 deleted", { undo: restore })`, `complain(error)` for refusals that have
// no control of their own. A toast stays 4 s, longer while the mouse or the focus is on it, and complaints until dismissed.

import { h } from "./dom.js";
import { icon } from "./icons.js";

const STAY_MS = 4000;

function shelf() {
  let node = document.querySelector(".toasts");
  if (!node) {
    node = h("div.toasts", { role: "region", "aria-label": "Messages" });
    document.body.append(node);
  }
  return node;
}

export function toast(text, { undo = null, label = "Undo", stay = STAY_MS, role = "status" } = {}) {
  const node = h("div.toast", { role }, h("span", {}, text));
  let timer = null;
  const close = () => {
    clearTimeout(timer);
    node.remove();
  };
  const wait = () => {
    clearTimeout(timer);
    if (stay) timer = setTimeout(close, stay);
  };
  if (undo) {
    node.append(h("button", { type: "button", onclick: () => {
      close();
      Promise.resolve(undo()).catch(complain);
    } }, label));
  } else if (!stay) {
    node.append(h("button", { type: "button", "aria-label": "Dismiss", onclick: close }, icon("cross")));
  } else {
    node.style.paddingRight = "var(--s-4)";
  }
  node.addEventListener("pointerenter", () => clearTimeout(timer));
  node.addEventListener("pointerleave", wait);
  node.addEventListener("focusin", () => clearTimeout(timer));
  node.addEventListener("focusout", wait);
  const host = shelf();
  while (host.children.length > 2) host.firstElementChild.remove();
  host.append(node);
  wait();
  return close;
}

export function complain(error) {
  const same = [...document.querySelectorAll(".toast")].find((node) => node.firstElementChild.textContent === error.message);
  same?.remove();
  toast(error.message, { stay: 0, role: "alert" });
  if (error.name !== "ApiError") throw error;
}
