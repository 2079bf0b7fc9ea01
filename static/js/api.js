// Talks to the REST interface under /api/v1. Every refusal becomes an ApiError whose message is a sentence for people.
//
//   await get("/projects")                        await all("/projects/7/tools")        (follows the pages of a list)
//   await post("/tools/3/draft/pick", { region }) await patch("/tools/3", { name }, tool.version)
//   await upload("/projects/7/tools", { file, name }, (fraction) => ...)
//
// POST carries an Idempotency-Key and is sent once more after a broken connection, so a retry never acts twice.
// Versioned resources want If-Match: pass `version` and a change made meanwhile elsewhere is refused, not overwritten.

const ROOT = "/api/v1";

export class ApiError extends Error {
  constructor(message, { status = 0, kind = "", requestId = "" } = {}) {
    super(message);
    this.name = "ApiError";
    this.status = status;
    this.kind = kind; // class name of the server's error, such as "RunActive"
    this.requestId = requestId;
  }
}

function freshKey() {
  const numbers = crypto.getRandomValues(new Uint8Array(16));
  return Array.from(numbers, (n) => n.toString(16).padStart(2, "0")).join("");
}

const UNREACHABLE = "The server does not answer. Your work is safe; try again in a moment.";

function refusal(status, text) {
  let problem = {};
  try {
    problem = JSON.parse(text);
  } catch {
    problem = {}; // a proxy or a crash answered in HTML: the status has to speak
  }
  const detail = typeof problem.detail === "string" ? problem.detail : "";
  const fallback = status === 412 ? "Somebody changed this meanwhile. It is shown anew; please repeat your change." : `The server refused this (${status}).`;
  return new ApiError(detail || problem.title || fallback, { status, kind: problem.error ?? "", requestId: problem.request_id ?? "" });
}

async function send(method, path, body, headers) {
  const options = { method, headers: { Accept: "application/json", ...headers } };
  if (body !== undefined) {
    options.headers["Content-Type"] = "application/json";
    options.body = JSON.stringify(body);
  }
  const response = await fetch(ROOT + path, options);
  const text = await response.text();
  if (!response.ok) throw refusal(response.status, text);
  return text ? JSON.parse(text) : null;
}

async function request(method, path, body, headers = {}) {
  try {
    return await send(method, path, body, headers);
  } catch (error) {
    if (error instanceof ApiError) throw error;
    if (error instanceof SyntaxError) throw new ApiError("The server sent something this page cannot read.");
    if (method === "POST") {
      try {
        return await send(method, path, body, headers);
      } catch (again) {
        if (again instanceof ApiError) throw again;
      }
    }
    throw new ApiError(UNREACHABLE);
  }
}

const match = (version) => (version === undefined || version === null ? {} : { "If-Match": `"${version}"` });

export const get = (path) => request("GET", path);
export const post = (path, body = {}) => request("POST", path, body, { "Idempotency-Key": freshKey() });
export const put = (path, body, version) => request("PUT", path, body, match(version));
export const patch = (path, body, version) => request("PATCH", path, body, match(version));
export const remove = (path, version) => request("DELETE", path, undefined, match(version));

// Every item of a paged list.
export async function all(path) {
  const items = [];
  let after = null;
  do {
    const mark = path.includes("?") ? "&" : "?";
    const page = await get(after ? `${path}${mark}after=${encodeURIComponent(after)}` : path);
    items.push(...page.items);
    after = page.next;
  } while (after);
  return items;
}

// Sends fields and one or more files; `onProgress` gets 0..1 of the bytes sent.
export function upload(path, fields, onProgress = () => {}) {
  const form = new FormData();
  for (const [name, value] of Object.entries(fields)) if (value !== undefined && value !== null) form.append(name, value);
  return new Promise((resolve, reject) => {
    const http = new XMLHttpRequest();
    http.open("POST", ROOT + path);
    http.setRequestHeader("Idempotency-Key", freshKey());
    http.setRequestHeader("Accept", "application/json");
    http.upload.onprogress = (event) => event.lengthComputable && onProgress(event.loaded / event.total);
    http.onerror = () => reject(new ApiError("The upload broke off before the file had arrived. Try again."));
    http.onload = () => (http.status < 300 ? resolve(JSON.parse(http.responseText)) : reject(refusal(http.status, http.responseText)));
    http.send(form);
  });
}
