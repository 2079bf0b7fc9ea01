// A name that can be changed where it stands: shows the name with a pencil, turns into a field, Enter saves, Escape leaves it.

import { h } from "./dom.js";
import { icon } from "./icons.js";

// save(name) is async and may throw an error whose message is shown under the field.
export function renameable(name, what, save, selector = "span.rename") {
  const host = h(selector);
  const rest = (text) => {
    const button = h("button.rename-open", { type: "button", "aria-label": `Rename ${what} ${text}`, dataset: { key: `rename-${what}-${text}` }, onclick: (event) => {
      event.stopPropagation();
      edit(text);
    } }, icon("pencil"));
    host.replaceChildren(h("span.rename-text", {}, text), button);
  };
  const edit = (text) => {
    const field = h("input.field", { value: text, maxlength: "80", "aria-label": `Name of this ${what}` });
    const fault = h("span.error-text", { role: "alert" });
    let busy = false;
    const finish = async (keep) => {
      const wanted = field.value.trim();
      if (busy) return;
      if (!keep || !wanted || wanted === text) return rest(text);
      busy = true;
      try {
        await save(wanted);
        rest(wanted);
        host.querySelector("button")?.focus();
      } catch (error) {
        field.setAttribute("aria-invalid", "true");
        fault.textContent = error.message;
      }
      busy = false;
    };
    field.addEventListener("keydown", (event) => {
      event.stopPropagation();
      if (event.key === "Enter") finish(true);
      if (event.key === "Escape") finish(false);
    });
    field.addEventListener("click", (event) => event.stopPropagation());
    field.addEventListener("blur", () => finish(true));
    host.replaceChildren(field, fault);
    field.focus();
    field.select();
  };
  rest(name);
  return host;
}
