// Builds elements without markup strings, so that names typed by people can never become HTML.
//
//   h("button.btn.primary#save", { onclick: save, "aria-label": "Save" }, icon("check"), "Save")
//
// Properties starting with "on" become listeners, `dataset` and `style` take objects, true/false sets or leaves out an
// attribute, null and undefined are skipped. Children may be nodes, strings, numbers, null or (nested) arrays of these.

export function h(selector, properties = {}, ...children) {
  const [tag, ...marks] = selector.split(/(?=[.#])/);
  const node = document.createElement(tag);
  for (const mark of marks) {
    if (mark[0] === "#") node.id = mark.slice(1);
    else node.classList.add(mark.slice(1));
  }
  for (const [name, value] of Object.entries(properties)) assign(node, name, value);
  node.append(...flat(children));
  return node;
}

function assign(node, name, value) {
  if (value === null || value === undefined || value === false) return;
  if (name.startsWith("on")) node.addEventListener(name.slice(2), value);
  else if (name === "dataset") Object.assign(node.dataset, value);
  else if (name === "style") for (const [key, entry] of Object.entries(value)) node.style.setProperty(key, entry);
  else if (name === "value" || name === "checked" || name === "indeterminate") node[name] = value;
  else node.setAttribute(name, value === true ? "" : String(value));
}

function flat(children) {
  return children.flat(Infinity).filter((child) => child !== null && child !== undefined && child !== false).map((child) => (child instanceof Node ? child : String(child)));
}

// Fills a node anew and keeps the keyboard focus: an element with the same data-key (or id) gets it back.
export function fill(host, ...children) {
  const active = host.contains(document.activeElement) ? document.activeElement : null;
  const key = active?.dataset.key;
  const id = active?.id;
  const top = host.scrollTop;
  host.replaceChildren(...flat(children));
  host.scrollTop = top;
  const again = key ? host.querySelector(`[data-key="${CSS.escape(key)}"]`) : id ? host.querySelector(`#${CSS.escape(id)}`) : null;
  again?.focus({ preventScroll: true });
}

export const byId = (id) => document.getElementById(id);

// Turns a sentence with **strong** parts into nodes.
export function rich(text) {
  return text.split("**").map((part, index) => (index % 2 ? h("b.strong", {}, part) : part));
}

export function skeleton(lines, height = "1.25rem") {
  return Array.from({ length: lines }, (_, index) => h("div.skeleton", { "aria-hidden": "true", style: { height, width: `${92 - 11 * (index % 3)}%`, margin: "0 0 .75rem" } }));
}
