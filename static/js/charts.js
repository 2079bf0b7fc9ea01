// Charts drawn as SVG from plain arrays: stacked bars per step, lines over time, the coverage dial. No state but the element.
const NS = "http://www.w3.org/2000/svg";

function svg(name, attributes = {}, parent = null, text = null) {
  const node = document.createElementNS(NS, name);
  for (const [key, value] of Object.entries(attributes)) node.setAttribute(key, value);
  if (text !== null) node.textContent = text;
  if (parent) parent.append(node);
  return node;
}

function frame(container) {
  container.replaceChildren();
  const width = Math.max(120, container.clientWidth), height = Math.max(80, container.clientHeight);
  return { root: svg("svg", { viewBox: `0 0 ${width} ${height}`, role: "img" }, container), width, height };
}

// Round steps of 1, 2 or 5 times a power of ten that cut [low, high] into about `wanted` pieces.
export function ticks(low, high, wanted = 3) {
  const span = high - low || 1, power = 10 ** Math.floor(Math.log10(span / wanted));
  const step = [1, 2, 5, 10].map(k => k * power).find(s => span / s <= wanted) ?? 10 * power;
  const out = [];
  for (let k = Math.ceil(low / step - 1e-9); k * step <= high + step * 1e-9; k++) out.push(k * step);
  return out;
}

const short = value => (Math.abs(value) >= 100 ? value.toFixed(0) : String(+value.toPrecision(3)));

// columns: [{title, parts: [..]}], keys: [{label, colour}]. Returns {only(k)} that fades all causes but one.
export function stackedBars(container, { keys, columns, left = 40, gap = 8, description }) {
  const { root, width, height } = frame(container), top = 22, bottom = height - 6;
  const highs = columns.map(c => c.parts.reduce((a, v) => a + Math.max(0, v), 0)), lows = columns.map(c => c.parts.reduce((a, v) => a + Math.min(0, v), 0));
  const high = Math.max(1e-9, ...highs), low = Math.min(0, ...lows), y = v => bottom - (v - low) / (high - low) * (bottom - top);
  root.setAttribute("aria-label", description);
  for (const t of ticks(low, high)) {
    svg("line", { class: t === 0 ? "base" : "grid", x1: left, x2: width, y1: y(t), y2: y(t) }, root);
    svg("text", { x: left - 8, y: y(t) + 4, "text-anchor": "end" }, root, short(t));
  }
  const slot = (width - left + gap) / columns.length, bar = Math.max(4, Math.min(slot - gap, 72)), bars = [];
  columns.forEach((column, i) => {
    const x = left + i * slot + (slot - gap - bar) / 2;
    let up = 0, down = 0;
    column.parts.forEach((value, k) => {
      if (Math.abs(value) < 1e-12) return;
      const from = value > 0 ? up : down, to = from + value;
      const rect = svg("rect", { class: "bar", x, width: bar, y: Math.min(y(from), y(to)), height: Math.max(0.5, Math.abs(y(from) - y(to)) - 1), rx: 1.5, fill: keys[k].colour, "data-k": k }, root);
      rect.dataset.tip = `${column.title}: ${keys[k].label} ${short(value)}`;
      bars.push(rect);
      if (value > 0) up = to; else down = to;
    });
    svg("text", { x: x + bar / 2, y: y(up) - 6, "text-anchor": "middle" }, root, short(column.parts.reduce((a, v) => a + v, 0)));
  });
  return { only: k => bars.forEach(b => { b.style.opacity = k === null || +b.dataset.k === k ? 1 : 0.2; }) };
}

// x, y: arrays of numbers. Returns {cursor(x)} that moves a hairline. `bands`: [{from, to, colour}] along the lower edge.
export function line(container, { title, x, y, high = null, limit = null, bands = [], unit = "", xTicks = true, left = 40 }) {
  const { root, width, height } = frame(container), right = width - 6, top = 20, bottom = height - (xTicks ? 22 : 8);
  const x0 = x[0] ?? 0, x1 = x.at(-1) ?? 1, top_value = high ?? Math.max(limit?.value ?? 0, ...y.filter(Number.isFinite), 1e-9) * 1.08;
  const px = v => left + (v - x0) / (x1 - x0 || 1) * (right - left), py = v => bottom - v / top_value * (bottom - top);
  root.setAttribute("aria-label", `${title}, from ${short(x0)} to ${short(x1)} ${unit}`);
  svg("text", { class: "title", x: 0, y: 11 }, root, title);
  for (const t of ticks(0, top_value)) {
    svg("line", { class: t === 0 ? "base" : "grid", x1: left, x2: right, y1: py(t), y2: py(t) }, root);
    svg("text", { x: left - 8, y: py(t) + 4, "text-anchor": "end" }, root, short(t));
  }
  if (limit) {
    svg("line", { class: "limit", x1: left, x2: right, y1: py(limit.value), y2: py(limit.value) }, root);
    svg("text", { x: right, y: py(limit.value) - 4, "text-anchor": "end", style: "fill:var(--bad)" }, root, limit.label);
  }
  for (const band of bands) svg("rect", { x: px(band.from), width: Math.max(1, px(band.to) - px(band.from) - 1), y: bottom + 1, height: 3, fill: band.colour }, root);
  if (xTicks) for (const t of ticks(x0, x1, 6)) svg("text", { x: px(t), y: height - 4, "text-anchor": "middle" }, root, short(t));
  if (xTicks && unit) svg("text", { x: right, y: height - 4, "text-anchor": "end" }, root, unit);
  let path = "", pen = "M";
  x.forEach((v, i) => { if (Number.isFinite(y[i])) { path += `${pen}${px(v).toFixed(1)} ${py(y[i]).toFixed(1)}`; pen = "L"; } else pen = "M"; });
  svg("path", { class: "series", d: path, stroke: "var(--ink)" }, root);
  const hair = svg("line", { class: "cursor", x1: left, x2: left, y1: top - 4, y2: bottom, visibility: "hidden" }, root);
  return { cursor: at => { hair.setAttribute("visibility", "visible"); for (const end of ["x1", "x2"]) hair.setAttribute(end, px(Math.min(x1, Math.max(x0, at)))); } };
}

// Half circle filled to `value` in [0, 1] with a mark at `goal`.
export function dial(container, value, goal) {
  container.replaceChildren();
  const root = svg("svg", { viewBox: "0 0 144 84", width: 144, height: 84, fill: "none", "stroke-width": 11, "aria-hidden": "true" }, container);
  const at = (t, r) => [72 - r * Math.cos(t * Math.PI), 76 - r * Math.sin(t * Math.PI)];
  const arc = (to, colour) => svg("path", { d: `M${at(0, 62)}A62 62 0 0 1 ${at(to, 62)}`, stroke: colour }, root);
  arc(1, "var(--sunken)");
  if (value > 0) arc(Math.min(1, value), "var(--ink-2)");
  svg("path", { d: `M${at(goal, 53)}L${at(goal, 72)}`, stroke: "var(--ink)", "stroke-width": 2 }, root);
  const words = document.createElement("b");
  words.textContent = value.toFixed(2);
  container.append(words);
}
