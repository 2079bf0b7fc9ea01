// One tooltip for the whole page: the `data-tip` text of whatever is under the pointer or has the keyboard focus.

let tip = null;
let shown = null;

function hide() {
  tip?.remove();
  tip = null;
  shown = null;
}

function place(x, y) {
  const box = tip.getBoundingClientRect();
  tip.style.left = `${Math.max(8, Math.min(x + 12, innerWidth - box.width - 8))}px`;
  tip.style.top = `${y - box.height - 12 < 8 ? y + 18 : y - box.height - 12}px`;
}

function show(node, x, y) {
  const text = node.dataset.tip;
  if (shown !== node || tip.textContent !== text) {
    hide();
    tip = document.createElement("div");
    tip.className = "tip";
    tip.setAttribute("role", "tooltip");
    tip.style.whiteSpace = "pre-line";
    tip.textContent = text;
    document.body.append(tip);
    shown = node;
  }
  place(x, y);
}

export function startTooltips() {
  addEventListener("pointermove", (event) => {
    const node = event.target.closest?.("[data-tip]");
    if (node?.dataset.tip) show(node, event.clientX, event.clientY);
    else hide();
  });
  addEventListener("focusin", (event) => {
    const node = event.target.closest?.("[data-tip]");
    if (!node?.dataset.tip || !node.matches(":focus-visible")) return;
    const box = node.getBoundingClientRect();
    show(node, box.left, box.top);
  });
  addEventListener("focusout", hide);
  addEventListener("scroll", hide, true);
  addEventListener("keydown", (event) => event.key === "Escape" && hide());
  document.addEventListener("pointerleave", hide);
}
