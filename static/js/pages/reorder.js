// Rows of a list moved by drag or by Alt with arrows; plain arrows walk. `move(from, to)` does what the list stands for.

export function reorderable(list, move) {
  let lifted = -1;
  const place = (event) => [...list.children].indexOf(event.target.closest("li"));
  const unmark = () => [...list.children].forEach((item) => item.removeAttribute("data-drag"));
  list.addEventListener("keydown", (event) => {
    const by = { ArrowUp: -1, ArrowDown: 1 }[event.key];
    const at = place(event);
    if (!by || at < 0) return;
    event.preventDefault();
    if (event.altKey) move(at, at + by);
    else list.children[at + by]?.focus();
  });
  list.addEventListener("dragstart", (event) => {
    lifted = place(event);
    event.dataTransfer.effectAllowed = "move";
  });
  list.addEventListener("dragover", (event) => {
    if (lifted < 0) return;
    event.preventDefault();
    unmark();
    list.children[place(event)]?.setAttribute("data-drag", "over");
  });
  list.addEventListener("drop", (event) => {
    event.preventDefault();
    move(lifted, place(event));
  });
  list.addEventListener("dragend", () => {
    lifted = -1;
    unmark();
  });
}
