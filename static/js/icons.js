// Icons of our own, drawn on a 24 x 24 grid with round strokes. `icon("play")` gives an <svg>; the word beside it is the name.

const PATHS = {
  undo: ["M8.5 4.5 4 9l4.5 4.5", "M4.5 9H14a5.25 5.25 0 0 1 0 10.5H9.5"],
  redo: ["M15.5 4.5 20 9l-4.5 4.5", "M19.5 9H10a5.25 5.25 0 0 0 0 10.5h4.5"],
  back: ["M18 6.5v11L9.5 12z", "M6 6.5v11"],
  forward: ["M6 6.5v11l8.5-5.5z", "M18 6.5v11"],
  pause: ["M9 6.5v11", "M15 6.5v11"],
  check: ["m5.5 12.5 4.2 4.2 8.8-9.4"],
  cross: ["M7 7l10 10", "M17 7 7 17"],
  plus: ["M12 5.5v13", "M5.5 12h13"],
  minus: ["M6.5 12h11"],
  right: ["m9.5 6.5 5.5 5.5-5.5 5.5"],
  down: ["m6.5 9.5 5.5 5.5 5.5-5.5"],
  grip: ["M9.5 6.5h.01", "M14.5 6.5h.01", "M9.5 12h.01", "M14.5 12h.01", "M9.5 17.5h.01", "M14.5 17.5h.01"],
  moon: ["M19.5 14A8 8 0 1 1 10 4.5a6.3 6.3 0 0 0 9.5 9.5z"],
  keyboard: ["M4.5 6.5h15a1.5 1.5 0 0 1 1.5 1.5v8a1.5 1.5 0 0 1-1.5 1.5h-15A1.5 1.5 0 0 1 3 16V8a1.5 1.5 0 0 1 1.5-1.5z", "M7 10.5h.01", "M10.5 10.5h.01", "M14 10.5h.01", "M17 10.5h.01", "M8.5 14h7"],
  warn: ["M12 4.5 20.5 19h-17z", "M12 10v4", "M12 16.5h.01"],
  info: ["M12 3.75a8.25 8.25 0 1 1 0 16.5 8.25 8.25 0 0 1 0-16.5z", "M12 11.25v4.5", "M12 8.25h.01"],
  rise: ["M4 19.5h16", "m6.5 15 4.5-4.5 3 2.5L19 7"],
  upload: ["M12 15.5V5", "m7.75 9 4.25-4.25L16.25 9", "M5 15.5v3h14v-3"],
  download: ["M12 4.5V15", "m7.75 11 4.25 4.25L16.25 11", "M5 16v3h14v-3"],
  trash: ["M5 7h14", "M9.5 7V5h5v2", "m7 7 .9 12h8.2L17 7", "M10.5 10.5v5", "M13.5 10.5v5"],
  pencil: ["m5 19 1-4L16 5l3 3L9 18z", "m13.75 7.25 3 3"],
  again: ["M19 12a7 7 0 1 1-2.2-5.1", "M19.25 3.75V8H15"],
  table: ["M4.5 6h15v12h-15z", "M4.5 10.25h15", "M4.5 14.25h15", "M10 6v12"],
  cube: ["M12 3.75 19.25 8v8L12 20.25 4.75 16V8z", "M4.75 8 12 12.25 19.25 8", "M12 12.25v8"],
  shield: ["M12 3.75 18.75 6v5.5c0 4-2.7 6.9-6.75 8.75-4.05-1.85-6.75-4.75-6.75-8.75V6z", "m9 12 2.2 2.2 4-4.4"],
  ring: ["M12 4.75a7.25 7.25 0 1 1 0 14.5 7.25 7.25 0 0 1 0-14.5z"],
  half: ["M12 4.75a7.25 7.25 0 1 1 0 14.5 7.25 7.25 0 0 1 0-14.5z"],
  stop: ["M7 7h10v10H7z"],
  swap: ["M4.5 9h14", "m15 5.5 3.5 3.5L15 12.5", "M19.5 15h-14", "m9 11.5L5.5 15 9 18.5"],
  code: ["m8.5 7-5 5 5 5", "m15.5 7 5 5-5 5"],
  pointer: ["m6 4.5 12.5 7-5.6 1.6-2.4 5.4z"],
  box: ["M5 8V5h3", "M16 5h3v3", "M19 16v3h-3", "M8 19H5v-3", "M11 5h2", "M11 19h2", "M5 11v2", "M19 11v2"],
  merge: ["M4.5 6h6v12h-6z", "M13.5 6h6v12h-6z", "M8 12h8", "m13.5 9.75 2.5 2.25-2.5 2.25"],
  plane: ["M4.5 6.5h15v11h-15z", "M15.5 3.5l-7 17"],
  grid: ["M4.5 5.5h15v13h-15z", "M4.5 12h15", "M9.5 5.5v13", "M14.5 5.5v13"],
  cut: ["M8.25 8.5 19 18", "M8.25 15.5 19 6", "M6 4.75a2.25 2.25 0 1 1 0 4.5 2.25 2.25 0 0 1 0-4.5z", "M6 14.75a2.25 2.25 0 1 1 0 4.5 2.25 2.25 0 0 1 0-4.5z"],
  reassign: ["M4.5 6h8v12h-8z", "M9.5 12h10", "m16 8.5 3.5 3.5-3.5 3.5"],
  surface: ["m12 5 8.5 4.25L12 13.5 3.5 9.25z", "m3.5 14.25 8.5 4.25 8.5-4.25"],
  lock: ["M6.5 11h11v8h-11z", "M8.75 11V8.25a3.25 3.25 0 0 1 6.5 0V11"],
  hide: ["M4.5 12s2.75-5 7.5-5c1.3 0 2.4.3 3.4.8", "M17.8 9.3c1.1 1.2 1.7 2.7 1.7 2.7s-2.75 5-7.5 5c-1.3 0-2.5-.4-3.5-.9", "M5 19 19 5"],
  eye: ["M4.5 12s2.75-5 7.5-5 7.5 5 7.5 5-2.75 5-7.5 5-7.5-5-7.5-5z", "M12 10a2 2 0 1 1 0 4 2 2 0 0 1 0-4z"],
  history: ["M5.2 9A7.5 7.5 0 1 1 4.5 12.5", "M4.5 5v4.25h4.25", "M12 8.25V12.5l3 1.75"],
  sort: ["m8.5 14 3.5 3.5 3.5-3.5"],
  rising: ["m8.5 14 3.5-3.5 3.5 3.5"],
};
const FILLED = {
  play: "M8.5 5.75v12.5L18.75 12z",
  half: "M12 4.75a7.25 7.25 0 0 1 0 14.5z",
};
const BOLD = new Set(["grip", "pause"]);
const SVG = "http://www.w3.org/2000/svg";

function shape(d, filled) {
  const path = document.createElementNS(SVG, "path");
  path.setAttribute("d", d);
  if (filled) {
    path.setAttribute("fill", "currentColor");
    path.setAttribute("stroke", "none");
  }
  return path;
}

export function icon(name, extra = "") {
  const svg = document.createElementNS(SVG, "svg");
  svg.setAttribute("class", `icon ${extra}`.trim());
  svg.setAttribute("viewBox", "0 0 24 24");
  svg.setAttribute("aria-hidden", "true");
  if (BOLD.has(name)) svg.style.strokeWidth = "2.4";
  for (const d of PATHS[name] ?? []) svg.append(shape(d, false));
  if (FILLED[name]) svg.append(shape(FILLED[name], true));
  return svg;
}

// The product's mark: four regions on a rising line, in the colours of the order of work, the last one in the signal colour.
export function mark() {
  const svg = document.createElementNS(SVG, "svg");
  svg.setAttribute("viewBox", "0 0 24 24");
  svg.setAttribute("aria-hidden", "true");
  const line = shape("M4 18.5 9.5 13l5.5 2.5 5-9.5", false);
  line.setAttribute("fill", "none");
  line.setAttribute("stroke", "currentColor");
  line.setAttribute("stroke-width", "1.8");
  svg.append(line);
  for (const [x, y, r, colour] of [[4, 18.5, 2.6, "--seq-2"], [9.5, 13, 2.6, "--seq-6"], [15, 15.5, 2.6, "--seq-9"], [20, 6, 3, "--signal"]]) {
    const dot = document.createElementNS(SVG, "circle");
    for (const [key, value] of Object.entries({ cx: x, cy: y, r })) dot.setAttribute(key, value);
    dot.style.fill = `var(${colour})`;
    svg.append(dot);
  }
  return svg;
}
