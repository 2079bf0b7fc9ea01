// The table of regions beside the 3D view: sortable, hover and selection both ways, names changed in place, all numbers with units.

import { get, patch } from "../api.js";
import { fill, h } from "../dom.js";
import { icon } from "../icons.js";
import { tint } from "../ramp.js";
import { renameable } from "../rename.js";
import { fixed, number, plural, sentence } from "../words.js";
import { regionNames } from "./tools-modes.js";

const by = (read) => (a, b) => read(a) - read(b);
const COLUMNS = [
  { key: "name", words: "Region", order: (a, b) => a.name.localeCompare(b.name, "en", { numeric: true }) },
  { key: "description", words: "Where", order: (a, b) => a.description.localeCompare(b.description) },
  { key: "area", words: "cm\u00b2", tip: "Surface area in square centimetres", order: by((region) => region.area_mm2), text: (region) => fixed(region.area_mm2 / 100) },
  { key: "aspect", words: "Aspect", wide: true, tip: "Length over width along its surface, cylinders and cones unrolled: 1 is as long as wide", order: by((region) => region.aspect ?? 0), text: (region) => fixed(region.aspect ?? NaN) },
  { key: "height", words: "Height", tip: "Highest point: 0 is the lowest of the working surface, 1 the highest", order: by((region) => region.height), text: (region) => fixed(region.height, 2) },
  { key: "curvature", words: "1/m", tip: "Strongest curvature, one over the radius in metres; positive is convex", order: by((region) => region.curvature_per_m), text: (region) => fixed(region.curvature_per_m) },
  { key: "free", words: "Free", wide: true, tip: "Part of its border that touches no other region, in centimetres", order: by((region) => region.free_border_mm ?? 0), text: (region) => fixed((region.free_border_mm ?? NaN) / 10) },
];

const KINDS = {
  plane: "Flat",
  cylinder: "Bent one way with one radius, like a pipe",
  cone: "Bent one way with a radius that grows evenly, like a funnel",
  sphere: "Bent all ways with one radius, like a ball",
  curved: "Bent evenly both ways, like a saddle or an egg",
  freeform: "Bent in no simple way",
  listed: "As the region table lists it",
};
const fold = (degrees) => (Math.abs(degrees) < 1 ? "smooth" : `${number(Math.abs(degrees), 2)}\u00b0 ${degrees > 0 ? "ridge" : "valley"}`);

// The whole text on hover, but only where the column cuts it.
function tipWhenCut({ currentTarget: cell }) {
  if (cell.scrollWidth > cell.clientWidth) cell.dataset.tip = cell.textContent;
  else delete cell.dataset.tip;
}

export class RegionTable {
  constructor(editor, { onRenamed }) {
    this.editor = editor;
    this.onRenamed = onRenamed;
    this.sort = { key: "name", falling: false };
    this.head = h("tr");
    this.body = h("tbody", { onkeydown: (event) => this.key(event) });
    this.table = h("table.region-table", { role: "grid", "aria-multiselectable": "true", "aria-label": "Regions", onpointerleave: () => editor.hover(null) }, h("thead", {}, this.head), this.body);
    this.scroll = h("div.scroll.table-wrap", {}, this.table);
    this.facts = h("div.region-facts");
    this.node = h("div.fill", { style: { flex: "1" } }, this.scroll, this.facts);
    this.shown = "";
    this.near = { of: "", list: null };
    this.rows = new Map();
    this.focused = 0;
  }

  draw() {
    const { tool, regions } = this.editor;
    const key = JSON.stringify([tool.id, tool.segmentation_id, regions, this.sort, document.documentElement.dataset.theme]);
    if (key !== this.shown && !this.body.querySelector("input")) {
      this.shown = key;
      this.drawHead();
      this.drawRows();
    }
    this.mark();
    this.drawFacts();
  }

  drawHead() {
    const { sort } = this;
    fill(this.head, COLUMNS.map((column) => {
      const chosen = column.key === sort.key;
      return h(`th${column.text ? ".num" : ""}${column.wide ? ".wide-only" : ""}`, { scope: "col", "aria-sort": chosen ? (sort.falling ? "descending" : "ascending") : "none" },
        h("button.sorter", { type: "button", dataset: { key: `sort-${column.key}`, tip: column.tip ?? "" }, onclick: () => this.sortBy(column.key) }, column.words, chosen ? icon(sort.falling ? "sort" : "rising") : null));
    }));
  }

  sortBy(key) {
    this.sort = { key, falling: this.sort.key === key ? !this.sort.falling : !["name", "description"].includes(key) };
    this.draw();
  }

  get ordered() {
    const { order } = COLUMNS.find((column) => column.key === this.sort.key);
    const list = [...this.editor.regions].sort(order);
    return this.sort.falling ? list.reverse() : list;
  }

  drawRows() {
    this.rows.clear();
    if (this.focused >= this.editor.regions.length) this.focused = 0;
    fill(this.body, this.ordered.map((region) => {
      const row = this.row(region);
      this.rows.set(region.id, row);
      return row;
    }));
  }

  row(region) {
    const { editor } = this;
    const name = renameable(region.name, "region", (wanted) => this.rename(region, wanted));
    return h("tr", { tabindex: region.id === this.focused ? "0" : "-1", dataset: { region: region.id, key: `region-${region.id}` }, onpointerenter: () => editor.hover(region.id), onfocus: () => this.focus(region.id), onclick: (event) => this.click(region.id, event) },
      h("td.nowrap", {}, h("span.swatch.pastel", { style: { "--swatch": tint(region.id) } }), name, this.flag(region, "locked", "lock", "Unlock"), this.flag(region, "hidden", "hide", "Show")),
      h("td.words", { onpointerenter: tipWhenCut }, region.description), COLUMNS.filter((column) => column.text).map((column) => h(`td.num${column.wide ? ".wide-only" : ""}`, {}, column.text(region))));
  }

  // A small lock or eye in the row takes the state back.
  flag(region, state, mark, words) {
    if (!region[state]) return null;
    return h("button.row-flag", { type: "button", "aria-label": `${words} ${region.name}`, dataset: { tip: `${state === "locked" ? "Locked" : "Hidden"}. ${words} it` }, onclick: (event) => {
      event.stopPropagation();
      this.editor.inTurn(() => this.editor.edit({ kind: state === "locked" ? "lock" : "hide", regions: [region.id], on: false }, `${words} ${region.name}`));
    } }, icon(mark));
  }

  async rename(region, wanted) {
    await patch(`/tools/${encodeURIComponent(this.editor.tool.id)}/regions/${region.id}`, { name: wanted });
    region.name = wanted;
    this.onRenamed();
  }

  // Opens the name of a region as a field.
  edit(id) {
    this.rows.get(id)?.querySelector(".rename-open")?.click();
  }

  click(id, event) {
    this.editor.pick(id, event.shiftKey || event.ctrlKey || event.metaKey);
  }

  focus(id) {
    this.focused = id;
    for (const [other, row] of this.rows) row.tabIndex = other === id ? 0 : -1;
    this.editor.hover(id);
  }

  key(event) {
    const row = event.target.closest("tr");
    if (event.target !== row) return;
    const id = Number(row.dataset.region);
    const step = { ArrowDown: "nextElementSibling", ArrowUp: "previousElementSibling" }[event.key];
    if (step) {
      const next = row[step];
      next?.focus();
      if (next && event.shiftKey && !this.editor.selection.includes(Number(next.dataset.region))) this.editor.toggle(Number(next.dataset.region));
    } else if (event.key === " ") this.editor.pick(id, true);
    else if (event.key === "Enter" && this.editor.mode === "select" && !this.editor.running) this.editor.pick(id);
    else return;
    event.preventDefault();
  }

  mark() {
    const { selection, hovered } = this.editor;
    for (const [id, row] of this.rows) {
      row.setAttribute("aria-selected", String(selection.includes(id)));
      row.toggleAttribute("data-hover", id === hovered);
    }
    const only = selection.length === 1 ? this.rows.get(selection[0]) : hovered === null ? null : this.rows.get(hovered);
    if (only && !only.matches(":hover")) only.scrollIntoView({ block: "nearest" });
  }

  drawFacts() {
    const { selection, regions } = this.editor;
    const one = selection.length === 1 ? regions[selection[0]] : null;
    if (one || selection.length === 2) this.askNear();
    const chosen = selection.length ? selection.map((id) => regions[id]) : regions;
    const area = `${number(chosen.reduce((sum, region) => sum + region.area_mm2, 0) / 100)} cm\u00b2`;
    const hidden = regions.filter((region) => region.hidden).map((region) => region.id);
    this.facts.classList.toggle("beside", hidden.length > 0);
    fill(this.facts, one ? this.factsOf(one) : h("p", {}, selection.length ? `${regionNames(this.editor, selection)}: ` : `${plural(regions.length, "region")}, `, h("b", {}, area), selection.length ? "" : " of working surface"), selection.length === 2 ? this.factsOfPair(selection) : null,
      hidden.length ? h("button.btn.quiet.small", { type: "button", dataset: { key: "show-all" }, onclick: () => this.editor.inTurn(() => this.editor.edit({ kind: "hide", regions: hidden, on: false }, "Show all")) }, icon("eye"), `Show ${plural(hidden.length, "hidden region")}`) : null);
  }

  factsOf(region) {
    const tilt = (Math.acos(Math.max(-1, Math.min(1, region.normal[2]))) * 180) / Math.PI;
    const round = ["cylinder", "sphere"].includes(region.kind) && Math.abs(region.curvature_per_m) > 1e-3;
    const shape = `${region.kind}${round ? `, radius ${number(1000 / Math.abs(region.curvature_per_m))} mm` : ""}, tilted ${number(tilt, 2)}\u00b0`;
    const size = region.length_mm === null ? "" : `, ${number(region.length_mm / 10)} \u00d7 ${number(region.width_mm / 10)} cm`;
    const border = region.perimeter_mm === null ? "" : `Border ${number(region.perimeter_mm / 10)} cm, ${number(region.free_border_mm / 10)} cm free; `;
    const touches = region.neighbours.length ? `touches ${this.beside(region)}` : "touches no other region";
    const middle = `Middle at ${region.centroid_mm.map((x) => number(x)).join(", ")} mm`;
    return [h("p", { dataset: { tip: `${KINDS[region.kind]}. ${middle}` } }, h("b", {}, region.name), ` ${shape}${size}`), h("p", { onpointerenter: tipWhenCut }, border ? border + touches : touches)];
  }

  // Its neighbours, with the angle to each once that is known.
  beside(region) {
    const turns = new Map((this.near.list?.items ?? []).filter((pair) => pair.touch === "border" && pair.angle_deg !== null)
      .flatMap(({ a, b, angle_deg: angle }) => [[`${a}-${b}`, angle], [`${b}-${a}`, angle]]));
    if (!turns.size) return regionNames(this.editor, region.neighbours);
    return region.neighbours.map((b) => `${regionNames(this.editor, [b])} (${fold(turns.get(`${region.id}-${b}`) ?? 0)})`).join(", ");
  }

  factsOfPair(selection) {
    const { list } = this.near;
    if (!list) return null;
    const [a, b] = [...selection].sort((x, y) => x - y);
    const pair = list.items.find((each) => each.a === a && each.b === b);
    const length = pair?.border_mm ? ` over ${number(pair.border_mm / 10)} cm` : "";
    const touch = !pair ? "Don't touch" : pair.touch === "corner" ? "Touch in a corner" : `${sentence(pair.angle_deg === null ? "neighbours" : fold(pair.angle_deg))}${length}${pair.touch === "rounding" ? `, across ${regionNames(this.editor, [pair.across])}` : ""}`;
    const way = list.distances_mm?.[a][b];
    return h("p", { dataset: { tip: "How the surface turns where they meet, and the shortest way over it from middle to middle" } }, way ? `${touch}; ${number(way / 10)} cm apart` : touch);
  }

  // How regions lie to each other is asked for once per cut, when somebody looks at one or two.
  askNear() {
    const { tool } = this.editor;
    if (this.near.of === tool.segmentation_id) return;
    const near = { of: tool.segmentation_id, list: null };
    this.near = near;
    get(`/tools/${encodeURIComponent(tool.id)}/neighbours`).then((list) => {
      near.list = list;
      if (this.near === near) this.drawFacts();
    }, () => { near.list = null; }); // the rest of the facts stands without
  }
}
