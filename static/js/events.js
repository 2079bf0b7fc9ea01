// One EventSource per page. `listen("run.changed", handler)` gets the event's data object; `await connect(projectId)` opens the
// stream: what a page reads after that, and listens to before it reads, misses nothing. The browser reconnects by itself with Last-Event-ID, and a stream that the server closed for good is opened anew.
//
// Handlers of the pseudo type "resync" run when events may have been missed: the page should read everything again.

const TYPES = [
  "tool.changed", "job.progress", "draft.changed", "demonstration.changed", "coverage.changed", "run.changed", "query.changed", "policy.changed",
  "plan.changed", "playback.changed", "session.picked", "session.editing", "scene.changed", "project.changed",
];
const RETRY_MS = 2000;
const WAIT_MS = 1000; // for the stream; a page that is read before it opens is told to read again

const handlers = new Map();
let source = null;
let late = false; // the next opening comes after something was read

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
  source.addEventListener("error", () => {
    if (source.readyState === EventSource.CLOSED) setTimeout(() => connect(projectId), RETRY_MS);
  });
  return new Promise((opened) => {
    const timer = setTimeout(() => ready(), WAIT_MS);
    const ready = () => {
      clearTimeout(timer);
      late = true;
      opened();
    };
    source.addEventListener("open", () => {
      if (late) tell("resync", {});
      ready();
    });
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
