// Reports of studies: every table and plot that `apprentice study` saved in the data folder, and the command that makes it.

import { all, get } from "../api.js";
import { fill, h, skeleton } from "../dom.js";
import { boot, query, remember, showFault } from "../shell.js";
import { complain, toast } from "../toasts.js";
import { ago, plural } from "../words.js";

const shell = await boot();
const parts = { list: h("nav.card.study-list", { "aria-label": "Studies" }), study: h("div.study", { "aria-live": "polite" }) };
const state = { studies: [], chosen: null };

const quoted = (path) => (/^[\w./:-]+$/.test(path) ? path : `'${path.replaceAll("'", "'\\''")}'`);

async function copy(text) {
  try {
    await navigator.clipboard.writeText(text);
    toast("The command is copied.");
  } catch {
    toast("The browser does not allow copying here; mark the command and copy it by hand.");
  }
}

const command = (text) => h("div.command", {}, h("code", {}, text), h("button.btn.small", { type: "button", dataset: { key: "copy" }, onclick: () => copy(text) }, "Copy"));

const made = (study) => (study.made_at ? ago(study.made_at) : "date unknown");

function paintList() {
  fill(parts.list, state.studies.map((study) => h("button", { type: "button", dataset: { key: `study-${study.name}` }, "aria-pressed": String(study.name === state.chosen?.name), onclick: () => open(study.name).catch(complain) },
    h("b.strong", {}, study.title), h("span.small.muted", {}, `${study.name}, ${made(study)}`))));
}

const isNumber = (table, k) => table.rows.some((row) => row[k] !== null) && table.rows.every((row) => row[k] === null || /^[\d−-]/.test(String(row[k])));
const shown = (value) => (value === null ? "-" : String(value));

function tableOf(table) {
  const mark = table.columns.map((_, k) => (k > 0 && isNumber(table, k) ? ".num" : ""));
  return h("section.card", {}, h("div.card-head", {}, h("h2", {}, table.title)),
    h("div.table-wrap", { tabindex: "0", role: "region", "aria-label": table.title }, h("table", {}, h("thead", {}, h("tr", {}, table.columns.map((name, k) => h(`th${mark[k]}`, { scope: "col" }, name)))),
      h("tbody", {}, table.rows.map((row) => h("tr", {}, row.map((value, k) => (k ? h(`td${mark[k]}`, {}, shown(value)) : h("th", { scope: "row" }, shown(value))))))))),
    table.note ? h("p.note-text", {}, table.note) : null);
}

function plotOf(study, plot) {
  const address = `/api/v1/studies/${encodeURIComponent(study.name)}/${encodeURIComponent(plot)}.svg?made=${encodeURIComponent(study.made_at ?? "")}`;
  return h("figure.card", {}, h("a", { href: address, target: "_blank", rel: "noopener", dataset: { tip: "Open the plot by itself" } }, h("img", { src: address, alt: `Plot: ${plot.replaceAll("_", " ")}`, width: "640", height: "400" })));
}

function paintStudy() {
  const study = state.chosen;
  const counts = [study.tables.length ? plural(study.tables.length, "table") : null, study.plots.length ? plural(study.plots.length, "plot") : null].filter(Boolean).join(", ");
  const when = study.made_at ? new Date(study.made_at).toLocaleString("en-GB", { dateStyle: "medium", timeStyle: "short" }) : "on an unknown date";
  fill(parts.study, h("section.card.pad", {}, h("h2", {}, study.title), h("p.small.muted", { style: { margin: "2px 0 var(--s-3)" } }, `Made ${when}. ${counts || "Nothing in it"}. To make it again:`),
    study.fault ? h("div.note.warn", { role: "alert" }, study.fault) : command(study.command)),
    study.tables.map(tableOf), study.plots.length ? h("div.study-plots", {}, study.plots.map((plot) => plotOf(study, plot))) : null);
}

async function open(name) {
  remember("study", name);
  const study = await get(`/studies/${encodeURIComponent(name)}`);
  state.chosen = study;
  paintList();
  paintStudy();
}

function showEmpty(folder) {
  fill(shell.main, h("div.head", {}, title("Nothing has been measured here yet.")),
    h("div.empty.studies-empty", {}, h("h2", {}, "No study has been saved"), h("p", {}, "A study compares learners, or repeats a figure of the paper, on the authors' tables. Run this in a terminal and come back; DIR is the folder with the tables."),
      command(`./dev study compare --data DIR --out ${quoted(`${folder}/compare`)}`), h("p.small.muted", {}, "Instead of compare: ablation, coverage, effort, synthetic or real. Every folder in ", h("span.strong", {}, folder), " is shown here.")));
}

const title = (words) => h("div.title", {}, h("h1", {}, "Studies"), h("p", {}, words));

async function start() {
  shell.crumb("Studies");
  fill(shell.main, skeleton(4, "2rem"));
  const { folder } = await get("/studies?limit=1");
  state.studies = await all("/studies");
  if (!state.studies.length) return showEmpty(folder);
  const wanted = query("study");
  await open((state.studies.find((study) => study.name === wanted) ?? state.studies[0]).name);
  return fill(shell.main, h("div.head", {}, title("How well the learners do, measured on the authors' tables by commands anyone can repeat.")), h("div.studies", {}, parts.list, parts.study));
}

try {
  await start();
} catch (error) {
  showFault(shell.main, error);
  throw error;
}
