// The frame around every page: top bar, rail, status, theme, keyboard help. A page module starts with
//
//   const shell = await boot();          // reads <body data-page>, the project from /p/{id}/..., events are connected
//   shell.project, shell.projectId, shell.main
//   shell.onProject((project) => ...)    // runs now and whenever the project changed
//   shell.crumb("Trough 10", () => [{ label, note, href, current }])   // last crumb, with a menu
//   shell.refresh()                      // read the project again
//
// Everything else a page needs is imported from the sibling modules.

import { get } from "./api.js";
import { fill, h } from "./dom.js";
import { connect, gathered, listen } from "./events.js";
import { icon, mark } from "./icons.js";
import { bind, showKeys, startKeys } from "./keys.js";
import { menuButton } from "./menu.js";
import { complain } from "./toasts.js";
import { startTooltips } from "./tooltips.js";
import { plural } from "./words.js";

export const STAGES = [
  { key: "tools", page: "tools", name: "Tools" },
  { key: "demonstrations", page: "record", name: "Demonstrations" },
  { key: "coverage", page: "coverage", name: "Coverage" },
  { key: "teach", page: "teach", name: "Teach" },
  { key: "policy", page: "policy", name: "Policy" },
  { key: "robot", page: "robot", name: "Robot" },
];
export const STAGE_WORDS = { done: "done", doing: "under way", wait: "waiting for you", todo: "not started" };

export const pageAddress = (projectId, page, query = {}) => {
  const words = new URLSearchParams(Object.entries(query).filter(([, value]) => value !== null && value !== undefined));
  return `/p/${encodeURIComponent(projectId)}/${page}${words.size ? `?${words}` : ""}`;
};

export const query = (name) => new URLSearchParams(location.search).get(name);

// Writes the choice into the address, so that a reload or a shared link shows the same thing.
export function remember(name, value) {
  const address = new URL(location.href);
  if (value === null) address.searchParams.delete(name);
  else address.searchParams.set(name, value);
  history.replaceState(null, "", address);
}

// What fits beside a station: "10", "5/6", "0.76", "3 wait". The full words are its tooltip.
function shortMeta({ state, meta }) {
  const text = meta.replace(" of ", "/");
  if (text.length <= 6) return text;
  const count = text.match(/^[\d.,/]+/)?.[0] ?? "";
  return state === "wait" && count ? `${count} wait` : count;
}

function railLink(stage, project, here) {
  const state = project?.stages.find((entry) => entry.key === stage.key) ?? { state: "todo", meta: "" };
  return h("a", { href: pageAddress(project?.id ?? projectFromAddress(), stage.page), dataset: { stage: state.state, key: stage.key, tip: state.meta }, "aria-current": stage.page === here ? "page" : null },
    h("span.stop", { "aria-hidden": "true" }), stage.name, h("span.visually-hidden", {}, `, ${STAGE_WORDS[state.state]}`),
    h(`span.meta${state.state === "wait" ? ".wait" : ""}`, {}, shortMeta(state)));
}

export function drawRail(project, here) {
  const rail = document.querySelector(".rail");
  fill(rail, h("ul", {}, h("li", {}, h("a", { href: "/", dataset: { key: "all" }, "aria-current": here === "projects" ? "page" : null }, "All projects"))),
    project || projectFromAddress() ? [h("p.label.rail-project", {}, project?.name ?? "\u00a0"), h("div.line", {}, STAGES.map((stage) => railLink(stage, project, here)))] : null,
    h("div.foot", {}, project ? h("a", { href: pageAddress(project.id, "process"), dataset: { key: "process" }, "aria-current": here === "process" ? "page" : null }, "What counts") : null, h("a", { href: "/studies", dataset: { key: "studies" }, "aria-current": here === "studies" ? "page" : null }, "Studies"), h("a", { href: "/docs", dataset: { key: "docs" } }, "REST interface")));
}

export function statusOf(project) {
  if (project?.counts.open_queries) return { state: "waiting", text: `Waiting for you: ${plural(project.counts.open_queries, "question")}`, page: "teach" };
  const waiting = project?.stages.find((stage) => stage.state === "wait");
  if (waiting) return { state: "waiting", text: `Waiting for you: ${waiting.meta}`, page: STAGES.find((stage) => stage.key === waiting.key).page };
  if (project?.running.length) return { state: "running", text: project.running[0].title, page: null };
  return { state: "idle", text: "Nothing is waiting", page: null };
}

function drawStatus(project) {
  const { state, text, page } = statusOf(project);
  const inside = [h("span.dot"), text];
  const node = page ? h("a.status", { dataset: { state, key: "status" }, href: pageAddress(project.id, page) }, inside) : h("span.status", { dataset: { state } }, inside);
  const host = document.querySelector(".topbar .push");
  if (host.textContent !== text || host.firstElementChild?.dataset.state !== state) fill(host, node);
}

function switchTheme() {
  const root = document.documentElement;
  root.dataset.theme = root.dataset.theme === "dark" ? "light" : "dark";
  try {
    localStorage.setItem("apprentice-theme", root.dataset.theme);
  } catch {
    // a private window keeps no choice: the theme still changes until the page is left
  }
  dispatchEvent(new Event("themechange"));
}

export const isDark = () => document.documentElement.dataset.theme === "dark";

function drawBar(crumbs) {
  const bar = document.querySelector(".topbar");
  bar.append(h("a.brand", { href: "/" }, mark(), "Apprentice"), crumbs, h("span.push", { role: "status", "aria-live": "polite" }),
    h("button.icon-btn", { type: "button", "aria-label": "Keys on this page", dataset: { tip: "Keys on this page (?)" }, onclick: showKeys }, icon("keyboard")),
    h("button.icon-btn", { type: "button", "aria-label": "Light or dark", dataset: { tip: "Light or dark" }, onclick: switchTheme }, icon("moon")));
}

function drawCrumbs(host, project, last) {
  const sep = () => h("span.sep", { "aria-hidden": "true" }, "/");
  if (!project) return fill(host, h("span.crumb", { "aria-current": "true" }, last?.label ?? "All projects"));
  const end = last?.items ? menuButton(last.label, last.items, "button.crumb-menu") : h("span.crumb", { "aria-current": "true" }, last?.label ?? "");
  end.querySelector?.("button")?.setAttribute("aria-current", "true");
  return fill(host, h("a", { href: "/" }, "Projects"), sep(), h("a", { href: pageAddress(project.id, "tools") }, project.name), last ? [sep(), end] : null);
}

function projectFromAddress() {
  const found = location.pathname.match(/^\/p\/([^/]+)\//);
  return found ? decodeURIComponent(found[1]) : null;
}

export function showFault(main, error) {
  fill(main, h("div.empty", { role: "alert", style: { margin: "auto" } }, h("h2", {}, "This page cannot be shown"), h("p", {}, error.message),
    h("a.btn", { href: "/" }, "Go to all projects")));
}

export async function boot() {
  const here = document.body.dataset.page;
  const projectId = projectFromAddress();
  const main = document.querySelector("main");
  const crumbs = h("nav.crumbs", { "aria-label": "You are here" });
  const watchers = [];
  const shell = { here, projectId, main, project: null, last: STAGES.find((stage) => stage.page === here) ? { label: STAGES.find((stage) => stage.page === here).name } : null };
  shell.show = (project) => {
    shell.project = project;
    drawRail(project, here);
    drawStatus(project);
    drawCrumbs(crumbs, project, shell.last);
    for (const watcher of watchers) watcher(project);
  };
  shell.refresh = async () => shell.show(await get(`/projects/${encodeURIComponent(projectId)}`));
  shell.onProject = (watcher) => {
    watchers.push(watcher);
    if (shell.project) watcher(shell.project);
  };
  shell.crumb = (label, items = null) => {
    shell.last = { label, items };
    drawCrumbs(crumbs, shell.project, shell.last);
  };
  drawBar(crumbs);
  drawRail(null, here);
  startTooltips();
  startKeys();
  bind({ key: "?", name: "Show these keys", run: showKeys });
  if (projectId) await open(shell);
  else drawCrumbs(crumbs, null, shell.last);
  return shell;
}

const QUIET = new Set(["session.picked", "session.editing", "scene.changed", "draft.changed"]); // say nothing about the project

async function open(shell) {
  try {
    await shell.refresh();
  } catch (error) {
    showFault(shell.main, error);
    throw error;
  }
  const again = gathered(() => shell.refresh().catch(complain), 300);
  listen("*", (type) => !QUIET.has(type) && again());
  listen("resync", again);
  await connect(shell.projectId);
  again(); // what changed before the stream was open
}
