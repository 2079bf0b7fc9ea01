// Picks regions by typing their names: one letter at once; names that begin alike (A and AA) wait a moment for the next letter.

import { bind } from "../keys.js";

const WAIT_MS = 600;

export function letterKeys({ regions, pick, name = "Pick a region by its letter" }) {
  let typed = "";
  let timer = null;
  const named = (text) => regions().find((region) => region.name.toLowerCase() === text);
  const longer = (text) => regions().some((region) => region.name.length > text.length && region.name.toLowerCase().startsWith(text));
  const finish = () => {
    clearTimeout(timer);
    const region = named(typed);
    typed = "";
    if (region) pick(region.id);
  };
  return bind({
    key: (key) => key.length === 1 && key !== " " && (Boolean(named(typed + key)) || longer(typed + key)),
    shown: "A to Z",
    name,
    run: (event) => {
      typed += event.key.toLowerCase();
      clearTimeout(timer);
      if (longer(typed)) timer = setTimeout(finish, WAIT_MS);
      else finish();
    },
  });
}
