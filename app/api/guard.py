"""The gate in front of every route: host names, origins, body sizes, request ids and response headers.

Host and origin checks hold off DNS rebinding and requests forged by foreign pages; they apply without a login too.
"""

import json
import re
import secrets
from typing import Any
from urllib.parse import urlsplit

from starlette.datastructures import Headers, MutableHeaders
from starlette.exceptions import HTTPException
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from app.api.errors import MEDIA_TYPE, NAMES, problem_fields

SAFE_METHODS = frozenset({"GET", "HEAD", "OPTIONS"})
JSON_LIMIT = 1_000_000  # bytes of a body that is not an upload
FORM_OVERHEAD = 64_000  # bytes a multipart body may add to the file
PAGE_POLICY = (
    "default-src 'self'; script-src 'self'; style-src 'self' 'unsafe-inline'; img-src 'self' data: blob:; connect-src 'self'; "
    "frame-src 'self'; frame-ancestors 'self'; object-src 'none'; base-uri 'none'; form-action 'self'"
)


class Guard:
    """ASGI middleware; the outermost layer of the application."""

    def __init__(self, app: ASGIApp, hosts: tuple[str, ...], max_upload_mb: int) -> None:
        self.app = app
        self.hosts = frozenset(hosts)
        self.max_upload_mb = max_upload_mb

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] not in ("http", "websocket"):
            await self.app(scope, receive, send)
            return
        headers = Headers(scope=scope)
        scope.setdefault("state", {})["request_id"] = known_request_id(headers) or secrets.token_hex(8)
        refusal = self._refusal(scope, headers)
        if refusal is not None:
            await _refuse(scope, send, *refusal)
        elif scope["type"] == "websocket":
            await self.app(scope, receive, send)
        else:
            await self.app(scope, self._limited(headers, receive), _with_headers(scope, send))

    def _refusal(self, scope: Scope, headers: Headers) -> tuple[int, str] | None:
        """Status and sentence when the request must not pass."""
        host = headers.get("host", "")
        if host_name(host) not in self.hosts:
            return 421, f"This server does not answer to the name {host!r}; use {' or '.join(sorted(self.hosts))}."
        changes = scope["type"] == "websocket" or scope["method"] not in SAFE_METHODS
        streams = scope["path"].endswith("/events")
        if (changes or streams) and is_foreign(headers, host):
            return 403, "Requests from pages of another origin are not accepted; open the application by its own address."
        length = headers.get("content-length", "")
        if length.isdigit() and int(length) > self._limit(headers):
            return 413, self._too_large(headers)
        return None

    def _limit(self, headers: Headers) -> int:
        if headers.get("content-type", "").startswith("multipart/form-data"):
            return self.max_upload_mb * 1_000_000 + FORM_OVERHEAD
        return JSON_LIMIT

    def _too_large(self, headers: Headers) -> str:
        if headers.get("content-type", "").startswith("multipart/form-data"):
            return f"The file is larger than {self.max_upload_mb} MB, the largest that is accepted. Export it with fewer triangles."
        return f"The request body is larger than {JSON_LIMIT // 1_000_000} MB, the largest that is accepted."

    def _limited(self, headers: Headers, receive: Receive) -> Receive:
        """`receive` that stops a body of unstated or false length once it passes the limit."""
        limit, seen = self._limit(headers), 0

        async def counted() -> Message:
            nonlocal seen
            message = await receive()
            seen += len(message.get("body", b""))
            if seen > limit:
                raise HTTPException(413, self._too_large(headers))
            return message

        return counted


def host_name(host: str) -> str:
    """'localhost' of 'localhost:8765'; '' when it can't be a host."""
    try:
        return urlsplit(f"//{host}").hostname or ""
    except ValueError:
        return ""


def is_foreign(headers: Headers, host: str) -> bool:
    """Whether a browser says that another site's page sent the request; programs send neither header."""
    origin = headers.get("origin")
    if origin is not None and urlsplit(origin).netloc != host:
        return True
    return headers.get("sec-fetch-site", "same-origin") not in ("same-origin", "none")


def known_request_id(headers: Headers) -> str | None:
    """The caller's own X-Request-ID when it is harmless to repeat."""
    given = headers.get("x-request-id", "")
    return given if re.fullmatch(r"[\w-]{1,64}", given, re.ASCII) else None


async def _refuse(scope: Scope, send: Send, status: int, detail: str) -> None:
    if scope["type"] == "websocket":
        await send({"type": "websocket.close", "code": 1008, "reason": detail[:120]})
        return
    fields: dict[str, Any] = problem_fields(status, NAMES[status], detail, scope["state"]["request_id"])
    body = json.dumps(fields).encode()
    headers = [(b"content-type", MEDIA_TYPE.encode()), (b"content-length", str(len(body)).encode())]
    await _with_headers(scope, send)({"type": "http.response.start", "status": status, "headers": headers})
    await send({"type": "http.response.body", "body": body})


def _with_headers(scope: Scope, send: Send) -> Send:
    """`send` that adds the security headers; a route's own policy (the 3D view has one) is kept."""

    async def guarded(message: Message) -> None:
        if message["type"] == "http.response.start":
            headers = MutableHeaders(scope=message)
            headers["X-Request-ID"] = scope["state"]["request_id"]
            headers["X-Content-Type-Options"] = "nosniff"
            headers["Referrer-Policy"] = "same-origin"
            headers["Cross-Origin-Opener-Policy"] = "same-origin"
            headers["Cross-Origin-Resource-Policy"] = "same-origin"
            headers.setdefault("Content-Security-Policy", PAGE_POLICY)
            if scope["path"].startswith("/api/"):
                headers.setdefault("Cache-Control", "no-store")
        await send(message)

    return guarded
