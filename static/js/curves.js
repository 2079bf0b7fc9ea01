// Learning curves: several lines over the iterations, drawn as SVG at the size of their box; values may be negative.
//
//   drawCurves(box, { title, x: [1, 2, ...], series: [{ name, colour: "var(--c-1)", values: [...] }], whole: true })
//
// Hovering shows the values of the nearest iteration. Long runs are thinned to one point per pixel.

import { number } from "./words.js";

const SVG = "http://www.w3.org/2000/svg";
const LEFT = 40;
const RIGHT = 12;
const TOP = 22;
const BOTTOM = 26;

function element(name, attributes, text = null) {
  const node = document.createElementNS(SVG, name);
  for (const [key, value] of Object.entries(attributes)) node.setAttribute(key, value);
  if (text !== null) node.textContent = text;
  return node;
}

function roundSteps(low, high, wanted, whole) {
  const span = high - low || 1;
  const power = 10 ** Math.floor(Math.log10(span / wanted));
  let step = [1, 2, 5, 10].map((factor) => factor * power).find((candidate) => span / candidate <= wanted) ?? 10 * power;
  if (whole) step = Math.max(1, Math.round(step));
  const marks = [];
  for (let k = Math.ceil(low / step - 1e-9); k * step <= high + step * 1e-9; k += 1) marks.push(Number((k * step).toPrecision(6)));
  return marks;
}

function bounds(series, whole) {
  const values = series.flatMap((line) => line.values).filter(Number.isFinite);
  const low = Math.min(0, ...values);
  const high = Math.max(0, ...values);
  const room = (high - low || 1) * 0.06;
  return { low: low < 0 ? low - room : 0, high: whole ? Math.max(1, high + 0.2) : high + room || 1 };
}

function points(x, values, toX, toY, width) {
  const every = Math.max(1, Math.floor(values.length / Math.max(60, width)));
  const pairs = [];
  for (let i = 0; i < values.length; i += every) pairs.push(`${toX(x[i]).toFixed(1)},${toY(values[i]).toFixed(1)}`);
  if ((values.length - 1) % every) pairs.push(`${toX(x.at(-1)).toFixed(1)},${toY(values.at(-1)).toFixed(1)}`);
  return pairs.join(" ");
}

export function drawCurves(box, { title, x, series, whole = false, xTitle = "step" }) {
  const { width, height } = box.getBoundingClientRect();
  if (width < 40 || height < 40) return;
  if (!x.length) {
    box.classList.add("skeleton");
    return;
  }
  box.classList.remove("skeleton");
  const { low, high } = bounds(series, whole);
  const first = x[0] ?? 0;
  const last = Math.max(first + 1, x.at(-1) ?? 1);
  const toX = (value) => LEFT + ((value - first) / (last - first)) * (width - LEFT - RIGHT);
  const toY = (value) => height - BOTTOM - ((value - low) / (high - low)) * (height - TOP - BOTTOM);
  const svg = element("svg", { class: "axis", role: "img", "aria-label": `${title}: ${series.map((line) => `${line.name} ${number(line.values.at(-1))}`).join(", ")}` });
  svg.append(element("text", { class: "title", x: 0, y: 11 }, title));
  for (const mark of roundSteps(low, high, 3, whole)) {
    svg.append(element("line", { class: mark === 0 ? "base" : "grid", x1: LEFT, x2: width - RIGHT, y1: toY(mark), y2: toY(mark) }), element("text", { x: LEFT - 8, y: toY(mark) + 4, "text-anchor": "end" }, number(mark)));
  }
  for (const mark of roundSteps(first, last, 5, true)) if (toX(mark) < width - RIGHT - 48) svg.append(element("text", { x: toX(mark), y: height - 6, "text-anchor": "middle" }, mark));
  svg.append(element("text", { x: width - RIGHT, y: height - 6, "text-anchor": "end" }, xTitle));
  for (const line of series) if (line.values.length) svg.append(element("polyline", { class: "series", style: `stroke: ${line.colour}`, points: points(x, line.values, toX, toY, width) }));
  addHover(svg, { x, series, toX, width, height, xTitle });
  box.replaceChildren(svg);
}

function addHover(svg, { x, series, toX, width, height, xTitle }) {
  const cursor = element("line", { class: "cursor", y1: TOP - 4, y2: height - BOTTOM + 4, visibility: "hidden" });
  const catcher = element("rect", { x: LEFT, y: TOP, width: Math.max(0, width - LEFT - RIGHT), height: Math.max(0, height - TOP - BOTTOM), fill: "transparent" });
  catcher.addEventListener("pointermove", (event) => {
    if (!x.length) return;
    const at = event.clientX - svg.getBoundingClientRect().left;
    const share = (at - LEFT) / (width - LEFT - RIGHT);
    const index = nearest(x, x[0] + share * (x.at(-1) - x[0]));
    catcher.dataset.tip = [`${xTitle} ${x[index]}`, ...series.map((line) => `${line.name}: ${number(line.values[index])}`)].join("\n");
    for (const end of ["x1", "x2"]) cursor.setAttribute(end, toX(x[index]));
    cursor.setAttribute("visibility", "visible");
  });
  catcher.addEventListener("pointerleave", () => cursor.setAttribute("visibility", "hidden"));
  svg.append(cursor, catcher);
}

function nearest(sorted, value) {
  let best = 0;
  for (let i = 1; i < sorted.length; i += 1) if (Math.abs(sorted[i] - value) < Math.abs(sorted[best] - value)) best = i;
  return best;
}
