"""The page /docs: all operations of the OpenAPI document, rendered here because the usual viewers load scripts from elsewhere."""

from html import escape
from typing import Any

from fastapi import APIRouter, Request
from fastapi.responses import HTMLResponse

router = APIRouter(include_in_schema=False)

STYLE = """body{font:15px/1.5 system-ui,sans-serif;max-width:60rem;margin:2rem auto;padding:0 1rem;color:#1d2530;background:#fff}
h2{margin-top:2rem;text-transform:capitalize}code{background:#eef1f5;padding:.1rem .3rem;border-radius:4px}
dt{margin-top:.8rem}dd{margin:.2rem 0 0 1.5rem;color:#445}b{display:inline-block;min-width:4rem}
@media(prefers-color-scheme:dark){body{color:#e5e9ef;background:#14181e}code{background:#252c36}dd{color:#aab4c0}}"""


@router.get("/docs", response_class=HTMLResponse)
def reference(request: Request) -> HTMLResponse:
    """All operations on one page."""
    return HTMLResponse(render(request.app.openapi()))


def render(document: dict[str, Any]) -> str:
    """The OpenAPI document as a plain page."""
    groups: dict[str, list[str]] = {}
    for path, operations in document["paths"].items():
        for method, operation in operations.items():
            tag = (operation.get("tags") or ["server"])[0]
            groups.setdefault(tag, []).append(_entry(path, method, operation))
    body = "".join(f"<h2>{escape(tag)}</h2><dl>{''.join(entries)}</dl>" for tag, entries in groups.items())
    title = escape(document["info"]["title"])
    return (
        f"<!doctype html><html lang='en'><head><meta charset='utf-8'><title>{title}: REST</title><style>{STYLE}</style></head><body>"
        f"<h1>{title}: REST</h1><p>{escape(document['info']['description'])} "
        f"The machine-readable form is <a href='/openapi.json'>/openapi.json</a>.</p>{body}</body></html>"
    )


def _entry(path: str, method: str, operation: dict[str, Any]) -> str:
    words = [escape(operation.get("description", ""))]
    names = [f"<code>{escape(p['name'])}</code>" for p in operation.get("parameters", []) if p["in"] != "path"]
    if names:
        words.append("Parameters: " + ", ".join(names) + ".")
    for media, content in operation.get("requestBody", {}).get("content", {}).items():
        words.append(f"Body: {escape(media)} {_schema_name(content.get('schema', {}))}.")
    results = ", ".join(f"{escape(code)}{_result(response)}" for code, response in operation["responses"].items() if code[0] == "2")
    words.append(f"Answers {results}.")
    return f"<dt><b>{method.upper()}</b> <code>{escape(path)}</code></dt><dd>{' '.join(words)}</dd>"


def _result(response: dict[str, Any]) -> str:
    schemas = [content.get("schema", {}) for content in response.get("content", {}).values()]
    names = [name for name in map(_schema_name, schemas) if name]
    return f" {names[0]}" if names else ""


def _schema_name(schema: dict[str, Any]) -> str:
    reference = schema.get("$ref") or next((s["$ref"] for s in schema.get("anyOf", []) if "$ref" in s), "")
    return f"<code>{escape(reference.rsplit('/', 1)[1])}</code>" if reference else ""
