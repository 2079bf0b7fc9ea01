// The ways of editing regions: what each is called, its key, what its clicks mean, what it says to do next, and the edit it asks
// of the server once enough was clicked. Pure: `editor` in, words and plain objects out.

import { number, plural } from "../words.js";

export const regionNames = (editor, ids) => {
  const names = ids.map((id) => editor.region(id)?.name ?? "?");
  return names.length < 2 ? names.join("") : `${names.slice(0, -1).join(", ")} and ${names.at(-1)}`;
};

const few = (editor) => (editor.selection.length > 4 ? plural(editor.selection.length, "region") : regionNames(editor, editor.selection));
const chosen = (editor, flag) => editor.selection.length > 0 && editor.selection.every((id) => editor.region(id)?.[flag]);
const points = (editor) => editor.points.map((point) => point.point_mm);

function pieceWords({ piece }) {
  const part = piece.share && piece.share < 0.995 ? `${number(piece.share * 100, 2)} % of ${piece.name}` : piece.name;
  return `${part}, ${number(piece.area_mm2 / 100)} cm\u00b2`;
}

// Every mode: pointing (see the scene of a session), hint(editor), missing(editor): why it can't act yet or "", words of the
// button, edit(editor). `atOnce`: acts as soon as it is chosen if nothing is
// missing; `once`: is left when it is done.
export const MODES = {
  select: {
    name: "Select", icon: "pointer", letter: "s", pointing: "select",
    hint: () => "Click a region. Shift-click adds one, Shift-drag draws a box around several.",
  },
  box: {
    name: "Box select", short: "Box", icon: "box", letter: "b", pointing: "select", box: true,
    hint: () => "Drag a box around regions. The view stands still meanwhile.",
  },
  merge: {
    name: "Merge", icon: "merge", letter: "m", pointing: "select", atOnce: true, once: true, tip: "Make one region of several that touch",
    hint: (e) => (e.selection.length < 2 ? "Click a region, then Shift-click those that should become one with it." : `${few(e)} become one region.`),
    missing: (e) => (e.selection.length < 2 ? "Select two or more regions that touch" : ""),
    words: (e) => `Merge ${few(e)}`,
    edit: (e) => ({ kind: "merge", regions: e.selection }),
  },
  plane: {
    name: "Split by plane", short: "Split", icon: "plane", letter: "p", pointing: "points", path: "plane", most: 2, tip: "Straight cut through two points",
    hint: (e) => ["Click two points on the region; a straight cut goes through both.", "Now the second point.", "The line shows the cut. Click again to move its second point."][Math.min(2, e.points.length)],
    missing: (e) => (e.points.length < 2 ? "Click two points on one region" : ""),
    words: (e) => `Split ${regionNames(e, [e.points[0].region])}`,
    edit: (e) => ({ kind: "split_plane", region: e.points[0].region, points_mm: points(e).slice(-2) }),
  },
  grid: {
    name: "Grid", icon: "grid", letter: "g", pointing: "select", once: true, tip: "Cut regions into rows and columns",
    hint: (e) => (e.selection.length ? `${few(e)} will be cut into even patches, aligned with each other.` : "Click the regions to cut into rows and columns."),
    missing: (e) => (!e.selection.length ? "Select at least one region" : !e.cell && e.rows * e.columns < 2 ? "One row and one column cut nothing" : ""),
    words: (e) => (e.cell ? `Cut into cells of ${number(e.cell)} cm` : `Cut into ${e.rows} \u00d7 ${e.columns}`),
    edit: (e) => ({ kind: "split_grid", regions: e.selection, ...(e.cell ? { size_mm: 10 * e.cell } : { rows: e.rows, columns: e.columns }) }),
  },
  cut: {
    name: "Cut", icon: "cut", letter: "c", pointing: "points", path: "line", tip: "Draw a line on the surface",
    hint: (e) => ["Click two points on the region; the cut follows the surface between them.", "Now the next point. Both ends run on to the nearest border."][e.points.length] ?? "More points bend the line. Backspace takes the last one back.",
    missing: (e) => (e.points.length < 2 ? "Click two or more points on one region" : e.closed && e.points.length < 3 ? "A closed line needs three points" : ""),
    words: (e) => `Cut ${regionNames(e, [e.points[0].region])}`,
    edit: (e) => ({ kind: "cut", region: e.points[0].region, path_mm: points(e), closed: e.closed }),
  },
  reassign: {
    name: "Reassign", short: "Move", icon: "reassign", letter: "r", pointing: "piece", tip: "Give a piece of a region to its neighbour",
    hint: (e) => (e.piece ? `${pieceWords(e)}. Click it again for a smaller piece.` : "Click the piece that belongs elsewhere; it is outlined."),
    missing: (e) => (!e.piece ? "Click a piece first" : e.piece.region === null ? "This patch is outside the working surface; use Surface to add it" : ""),
    words: (e) => (e.to === "new" ? "Make it a region" : `Give it to ${e.to === null ? (e.piece.to_name ?? "its neighbour") : regionNames(e, [e.to])}`),
    edit: (e) => ({ kind: "reassign", point_mm: points(e).at(-1), level: e.level, to: e.to }),
  },
  surface: {
    name: "Working surface", short: "Surface", icon: "surface", letter: "w", pointing: "piece", tip: "Which regions are worked on",
    hint: () => "Click a grey patch to add it to the working surface, a region to take it off. Undo takes it back.",
    missing: (e) => (e.points.length ? "" : "Click a patch"),
    words: () => "",
    edit: (e) => ({ kind: "working", on: e.points.at(-1).region === null, points_mm: points(e).slice(-1) }),
  },
  lock: {
    name: "Lock", icon: "lock", letter: "l", pointing: "select", atOnce: true, once: true, tip: "Nothing changes a locked region",
    hint: (e) => (e.selection.length ? `${few(e)} selected.` : "Click the regions that should stay as they are."),
    missing: (e) => (e.selection.length ? "" : "Select at least one region"),
    words: (e) => `${chosen(e, "locked") ? "Unlock" : "Lock"} ${few(e)}`,
    edit: (e) => ({ kind: "lock", regions: e.selection, on: !chosen(e, "locked") }),
  },
  hide: {
    name: "Hide", icon: "hide", letter: "h", pointing: "select", atOnce: true, once: true, tip: "Look behind a region; it stays in the tool",
    hint: (e) => (e.selection.length ? `${few(e)} selected.` : "Click the regions that are in the way. They stay part of the tool."),
    missing: (e) => (e.selection.length ? "" : "Select at least one region"),
    words: (e) => `${chosen(e, "hidden") ? "Show" : "Hide"} ${few(e)}`,
    edit: (e) => ({ kind: "hide", regions: e.selection, on: !chosen(e, "hidden") }),
  },
  rename: {
    name: "Rename", icon: "pencil", key: "F2", pointing: "select", tip: "Another name for the selected region",
    hint: () => "Click the region to name.",
    missing: (e) => (e.selection.length === 1 ? "" : "Select one region"),
    words: () => "",
  },
};

// Modes in the order of the toolbar; null is a gap.
export const ORDER = ["select", "box", null, "merge", "plane", "grid", "cut", "reassign", null, "surface", "lock", "hide", "rename"];

export const shownKey = (mode) => MODES[mode].key ?? `Shift ${MODES[mode].letter.toUpperCase()}`;
