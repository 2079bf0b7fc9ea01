// The arm at work: computes a preview of a plan, plays it in the 3D view, shows force and path error, names problems per region.

import { all, get, post } from "../api.js";
import { line } from "../charts.js";
import { fill, h } from "../dom.js";
import { gathered, listen } from "../events.js";
import { icon } from "../icons.js";
import { bind } from "../keys.js";
import { rampColour, sequenceStyle } from "../ramp.js";
import { boot, pageAddress, query, remember, showFault } from "../shell.js";
import { complain } from "../toasts.js";
import { View3D } from "../view3d.js";
import { number, plural, spoken } from "../words.js";

const SPEEDS = [1, 2, 4, 8];
const FRAME_MS = 40; // how often slider and plots follow the clock while playing
const FORCE_SLACK = 1.35; // the dashed limit: touch-down peak allowed above the commanded force

const shell = await boot();
const parts = {
  head: h("div.head"),
  stage: h("div.stage", { "aria-label": "3D view" }),
  live: h("div.tl.live", { "aria-live": "off" }),
  play: h("button.icon-btn", { type: "button", style: { "margin-left": "-8px" }, onclick: () => toggle() }),
  bands: h("div.bands"),
  slider: h("input", { type: "range", min: "0", step: "0.1", value: "0", "aria-label": "Time" }),
  at: h("span.at.num"),
  speed: h("button.btn.quiet.small", { type: "button", dataset: { tip: "Playback speed (S)" }, onclick: () => nextSpeed() }),
  timeline: h("div.timeline"),
  plots: h("div.robot-plots"),
  force: h("div.chart"),
  path: h("div.chart"),
  alert: h("div.alert"),
  rows: h("tbody"),
  totals: h("dl.totals"),
};
const state = { plans: [], plan: null, playback: null, view: null, time: 0, speed: 1, clock: null, forceLine: null, pathLine: null };

const clock = (seconds) => `${Math.floor(seconds / 60)}:${String(Math.floor(seconds % 60)).padStart(2, "0")}`;
const ready = () => state.playback?.state === "ready";
const duration = () => state.playback?.cycle_s ?? 0;
const problems = () => (ready() ? state.playback.regions.filter((entry) => entry.problems.length) : []);

// ---- clock --------------------------------------------------------------------------------------------------------------------

function toggle() {
  if (!ready()) return;
  if (state.clock) pause();
  else play();
}

function play() {
  if (state.time >= duration() - 0.05) seek(0);
  const began = performance.now() - (state.time / state.speed) * 1000;
  state.view.control("play", { time: state.time, speed: state.speed }).catch(complain);
  state.clock = setInterval(() => {
    state.time = Math.min(duration(), ((performance.now() - began) / 1000) * state.speed);
    paintTime();
    if (state.time >= duration()) pause();
  }, FRAME_MS);
  paintTime();
}

function pause() {
  if (!state.clock) return;
  clearInterval(state.clock);
  state.clock = null;
  state.view.control("pause", { time: state.time }).catch(complain);
  paintTime();
}

const sendSeek = gathered(() => state.view.control("seek", { time: state.time }).catch(complain), 60);

function seek(time) {
  if (state.clock) pause();
  state.time = Math.max(0, Math.min(duration(), time));
  sendSeek();
  paintTime();
}

function nextSpeed() {
  state.speed = SPEEDS[(SPEEDS.indexOf(state.speed) + 1) % SPEEDS.length];
  const playing = Boolean(state.clock);
  if (playing) {
    clearInterval(state.clock);
    state.clock = null;
    play();
  }
  parts.speed.textContent = `${state.speed}x`;
}

// ---- painting -------------------------------------------------------------------------------------------------------------------

function paintTime() {
  const { series, regions } = state.playback;
  parts.slider.value = String(state.time);
  parts.at.textContent = `${clock(state.time)} of ${clock(duration())}`;
  parts.play.replaceChildren(icon(state.clock ? "pause" : "play"));
  parts.play.setAttribute("aria-label", state.clock ? "Pause" : "Play");
  const here = regions.find((entry) => state.time >= entry.start_s && state.time < entry.end_s);
  let i = series.t.findIndex((t) => t >= state.time);
  if (i < 0) i = series.t.length - 1;
  fill(parts.live, h("span", {}, here ? "Region " : "Moving over", here ? h("b", {}, here.name) : null), h("span", {}, "Force ", h("b", {}, number(series.force_n[i] ?? 0, 3)), " N"), h("span", {}, "Off path ", h("b", {}, number(series.off_path_mm[i] ?? 0, 2)), " mm"));
  state.forceLine?.cursor(state.time);
  state.pathLine?.cursor(state.time);
  for (const row of parts.rows.children) row.setAttribute("aria-selected", String(here?.region === Number(row.dataset.region)));
}

function paintPlots() {
  const { series, regions, force_target_n: target } = state.playback;
  const bands = regions.filter((entry) => entry.end_s > entry.start_s).map((entry) => ({ from: entry.start_s, to: entry.end_s, colour: rampColour(entry.step - 1, regions.length) }));
  const limit = { value: target * FORCE_SLACK, label: `limit ${number(target * FORCE_SLACK, 2)} N` };
  state.forceLine = line(parts.force, { title: "Force, N", x: series.t, y: series.force_n, limit, xTicks: false });
  state.pathLine = line(parts.path, { title: "Off path, mm", x: series.t, y: series.off_path_mm, bands, unit: "seconds" });
}

function row(entry) {
  const done = entry.end_s > entry.start_s;
  const bad = entry.problems.length > 0;
  return h("tr", { tabindex: "0", dataset: { region: entry.region, key: `row-${entry.region}`, ...(bad ? { tip: entry.problems.map((problem) => problem.text).join("\n") } : {}) }, onclick: () => done && seek(entry.start_s), onkeydown: (event) => event.key === "Enter" && done && seek(entry.start_s) },
    h("td", {}, h("span.seq-no", { style: sequenceStyle(entry.step - 1, state.playback.regions.length) }, entry.step)), h("td.strong", {}, entry.name),
    h("td.num", {}, done ? `${number(entry.force_rms_n, 2)} N` : "-"), h("td.num", {}, done ? `${number(entry.off_path_mm, 2)} mm` : "-"), h("td.num", {}, done ? `${(100 * entry.covered).toFixed(1)} %` : "-"), h("td.num", {}, done ? `${Math.round(entry.end_s - entry.start_s)} s` : "-"),
    h(`td.${bad ? "flag" : "good"}`, {}, icon(bad ? "warn" : "check"), h("span.visually-hidden", {}, bad ? "to look at" : "fine")));
}

function paintReady() {
  const { playback } = state;
  const flagged = problems();
  parts.alert.hidden = flagged.length === 0;
  fill(parts.alert, icon("warn"), h("div", {}, flagged.flatMap((entry) => entry.problems.map((problem) => h("p", {}, problem.text)))));
  fill(parts.rows, playback.regions.map(row));
  const fact = (term, value, tip) => h("div.fact", { dataset: { tip } }, h("dt", {}, term), h("dd", {}, value));
  fill(parts.totals, fact("Cycle", clock(duration()), "Time from first to last movement"), fact("In contact", `${Math.round(100 * playback.in_contact_share)} %`, "Share of the time with the roller on the part"), fact("Force error", `${number(playback.force_error_n, 2)} N`, "Root mean square of measured minus commanded force while in contact"), fact("Covered", `${(100 * playback.covered).toFixed(1)} %`, "Share of the area under the roller's path"));
  parts.slider.max = String(duration());
  fill(parts.bands, playback.regions.map((entry) => h("i", { style: { "--seq": rampColour(entry.step - 1, playback.regions.length), flex: String(Math.max(0.01, entry.end_s - entry.start_s)) } })));
  paintPlots();
  paintTime();
}

function words() {
  const { playback } = state;
  if (!playback) return "Not previewed yet.";
  if (playback.state === "failed") return playback.error?.detail ?? "The preview failed.";
  if (!ready()) return playback.job?.message || "The preview is being computed.";
  return `Roller at ${number(playback.force_target_n, 2)} N, ${clock(duration())} min in simulation.`;
}

function paintHead() {
  const flagged = problems();
  const busy = state.playback && !ready() && state.playback.state !== "failed";
  const again = h(`button.btn${ready() ? "" : ".primary"}`, { type: "button", "aria-disabled": String(Boolean(busy)), dataset: { key: "preview" }, onclick: () => !busy && preview().catch(complain) }, ready() ? "Compute again" : "Preview");
  const [kicker, text] = busy ? ["Computing", `${Math.round(100 * (state.playback.job?.fraction ?? 0))} % of the motion`]
    : ready() ? (flagged.length ? [`Next: look at ${spoken(flagged.length, "region")}`, flagged.map((entry) => entry.name).join(", ")] : ["Nothing stands in the way", "every region is reached"]) : ["Next: preview the motion", "reach, force and path are checked"];
  fill(parts.head, h("div.title", {}, h("h1", {}, `The robot on ${state.plan.tool_name}`), h("p", {}, words())), h(`div.next${ready() && !flagged.length ? ".calm" : ""}`, {}, h("p", {}, h("span.kicker", {}, kicker), text), again));
}

function paint() {
  paintHead();
  const { playback, plan } = state;
  const busy = parts.stage.querySelector(".preview-wait");
  busy?.remove();
  for (const node of [parts.live, parts.timeline, parts.plots, parts.totals]) node.hidden = !ready();
  if (ready()) {
    paintReady();
    state.view.show({ mode: "robot", tool_id: plan.tool_id, sequence: plan.sequence, playback_id: playback.id }, `The arm works ${plan.tool_name}, ${plural(plan.sequence.length, "region")}`);
    return;
  }
  state.view.show({ mode: "sequence", tool_id: plan.tool_id, sequence: plan.sequence }, `${plan.tool_name} with its order`);
  parts.alert.hidden = true;
  fill(parts.rows, plan.steps.map((step, i) => h("tr", {}, h("td", {}, h("span.seq-no", { style: sequenceStyle(i, plan.steps.length) }, i + 1)), h("td.strong", {}, step.name), h("td", { colspan: "5" }, ""))));
  if (playback && playback.state !== "failed") {
    parts.stage.append(h("div.bc.live.preview-wait", { role: "status" }, h("span", {}, playback.job?.message || "Waiting for a free processor"), h("div.progress", { style: { width: "10rem", "align-self": "center" } }, h("i", { style: { width: `${100 * (playback.job?.fraction ?? 0)}%` } }))));
  }
}

// ---- reading ----------------------------------------------------------------------------------------------------------------------

async function preview() {
  document.activeElement?.blur(); // so that the space bar plays instead of computing again
  pause();
  state.time = 0;
  state.playback = await post(`/plans/${state.plan.id}/playbacks`);
  paint();
}

async function open(plan) {
  pause();
  state.time = 0;
  state.plan = plan;
  remember("plan", plan.id);
  const playbacks = await all(`/plans/${plan.id}/playbacks`);
  state.playback = playbacks.reduce((latest, entry) => (!latest || entry.id > latest.id ? entry : latest), null);
  if (state.playback) state.playback = await get(`/playbacks/${state.playback.id}`);
  shell.crumb(plan.tool_name, () => state.plans.map((entry) => ({ label: entry.tool_name, note: "", current: entry.id === state.plan.id, run: () => open(entry).catch(complain) })));
  paint();
}

async function reload() {
  if (!state.playback) return;
  const was = state.playback.state;
  state.playback = await get(`/playbacks/${state.playback.id}`);
  if (was !== state.playback.state || !ready()) paint();
}

async function loadPlans() {
  const policies = await all(`/projects/${shell.projectId}/policies`);
  const latest = policies.reduce((best, policy) => (!best || policy.created_at > best.created_at ? policy : best), null);
  if (!latest) return;
  const plans = await all(`/policies/${latest.id}/plans`);
  const newest = new Map();
  for (const plan of plans.sort((a, b) => (a.created_at < b.created_at ? -1 : 1))) newest.set(plan.tool_id, plan);
  state.plans = [...newest.values()];
}

function showEmpty() {
  fill(shell.main, h("div.head", {}, h("div.title", {}, h("h1", {}, "Robot"), h("p", {}, "Watch the arm execute an order on a tool."))),
    h("div.empty", {}, h("h2", {}, "No order to execute yet"), h("p", {}, "Get the order for a tool first; the robot then shows it."), h("a.btn.primary", { href: pageAddress(shell.projectId, "policy") }, "Go to the policy")));
}

async function start() {
  await loadPlans();
  const wanted = query("plan");
  const plan = wanted ? await get(`/plans/${encodeURIComponent(wanted)}`) : state.plans.at(-1);
  if (!plan) return showEmpty();
  parts.slider.addEventListener("input", () => seek(Number(parts.slider.value)));
  parts.speed.textContent = "1x";
  const th = (label, tip) => h("th.num", { dataset: { tip } }, label);
  parts.stage.append(parts.live);
  parts.timeline.append(h("div.scrubber", {}, parts.play, h("div.track", {}, parts.bands, parts.slider), parts.at, parts.speed));
  parts.plots.append(parts.force, parts.path);
  fill(shell.main, parts.head, h("div.robot", {},
    h("section.card.cell-card", {}, parts.stage, parts.timeline, parts.plots),
    h("aside.card.fill", {}, parts.alert, h("div.table-wrap.scroll", {}, h("table", {}, h("thead", {}, h("tr", {}, h("th", {}, "Step"), h("th", {}, "Region"), th("Force error", "Root mean square of measured minus commanded force"), th("Off path", "Largest sideways distance from the planned stroke"), th("Covered", "Share of the region's area under the roller"), th("Time", "From touch-down to lift-off"), h("th", {}, h("span.visually-hidden", {}, "State")))), parts.rows)), parts.totals)));
  state.view = new View3D(parts.stage, { projectId: shell.projectId, name: "robot" });
  bind({ key: " ", shown: "Space", name: "Play or pause", run: toggle });
  bind({ key: "ArrowLeft", shown: "←", name: "One second back", when: ready, run: () => seek(state.time - 1) });
  bind({ key: "ArrowRight", shown: "→", name: "One second on", when: ready, run: () => seek(state.time + 1) });
  bind({ key: "s", name: "Playback speed", when: ready, run: nextSpeed });
  listen("job.progress", ({ job_id: job, fraction, message }) => {
    if (state.playback?.job?.id !== job) return;
    state.playback.job = { id: job, fraction, message };
    if (!ready()) paint();
  });
  listen("playback.changed", ({ playback_id: id }) => id === state.playback?.id && reload().catch(complain));
  listen("resync", () => reload().catch(complain));
  await open(plan);
  addEventListener("resize", gathered(() => ready() && paintReady(), 150));
  addEventListener("themechange", paint);
  return undefined;
}

try {
  await start();
} catch (error) {
  showFault(shell.main, error);
  throw error;
}
