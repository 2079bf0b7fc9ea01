// One EventSource per page. `listen("run.changed", handler)` gets the event's data object; `connect(projectId)` opens the
// stream, the browser reconnects by itself with Last-Event-ID, and a stream that the server closed for good is opened anew.
//
// Handlers of the pseudo type "resync" run when events may have been missed: the page should read everything again.

const TYPES = [
  "tool.changed", "job.progress", "draft.changed", "demonstration.changed", "coverage.changed", "run.changed", "query.changed", "policy.changed",
  "plan.changed", "playback.changed", "session.picked", "session.editing", "scene.changed", "project.changed",
];
const RETRY_MS = 2000;

const handlers = new Map();
let source = null;
let wasOpen = false;

export function listen(type, handler) {
  if (!handlers.has(type)) handlers.set(type, new Set());
  handlers.get(type).add(handler);
  return () => handlers.get(type).delete(handler);
}

function tell(type, data) {
  for (const handler of handlers.get(type) ?? []) handler(data);
  if (type !== "resync") for (const handler of handlers.get("*") ?? []) handler(type, data);
}

export function connect(projectId) {
  source?.close();
  source = new EventSource(projectId ? `/api/v1/events?project=${encodeURIComponent(projectId)}` : "/api/v1/events");
  for (const type of TYPES) source.addEventListener(type, (event) => tell(type, JSON.parse(event.data)));
  source.addEventListener("resync", () => tell("resync", {}));
  source.addEventListener("open", () => {
    if (wasOpen) tell("resync", {});
    wasOpen = true;
  });
  source.addEventListener("error", () => {
    if (source.readyState === EventSource.CLOSED) setTimeout(() => connect(projectId), RETRY_MS);
  });
}

// Runs `action` at most once per `wait` milliseconds, the last call always: many events, one reading.
export function gathered(action, wait = 120) {
  let timer = null;
  return () => {
    timer ??= setTimeout(() => {
      timer = null;
      action();
    }, wait);
  };
}

addEventListener("pagehide", () => source?.close());
