"""Idempotency-Key on POST: a repeated request gets the stored answer instead of acting again.

Refusals are not stored: nothing was changed, so the request may be tried again with the same key.
"""

import asyncio
import hashlib
import weakref
from collections.abc import Callable, Coroutine
from typing import Annotated, Any

from fastapi import Header, Request, Response
from fastapi.routing import APIRoute
from starlette.concurrency import run_in_threadpool
from starlette.exceptions import HTTPException

from app.workflow import idempotency as workflow

MOST_LENGTH = 128
KEPT_HEADERS = ("location", "etag", "content-type")

IdempotencyKey = Annotated[
    str | None, Header(alias="Idempotency-Key", max_length=MOST_LENGTH, description="Makes repeating this POST harmless.")
]


class ActionRoute(APIRoute):
    """A route whose POSTs honour Idempotency-Key."""

    def get_route_handler(self) -> Callable[[Request], Coroutine[Any, Any, Response]]:
        plain = super().get_route_handler()

        async def handle(request: Request) -> Response:
            key = request.headers.get("idempotency-key")
            if request.method != "POST" or key is None:
                return await plain(request)
            if not 1 <= len(key) <= MOST_LENGTH:
                raise HTTPException(422, f"Idempotency-Key has {len(key)} characters; 1 to {MOST_LENGTH} are accepted.")
            return await once(request, key, plain)

        return handle


async def once(request: Request, key: str, act: Callable[[Request], Coroutine[Any, Any, Response]]) -> Response:
    """Answer from the store, or act and store the answer. A second request with the key in flight waits for the first."""
    ctx = request.app.state.context
    digest = await request_hash(request)
    async with _lock(request, key):
        stored = await run_in_threadpool(workflow.recall, ctx, key, digest)
        if stored is not None:
            headers = {**stored["headers"], "Idempotent-Replay": "true"}
            return Response(stored["body"], stored["status"], headers=headers)
        response = await act(request)
        headers = {name: value for name, value in response.headers.items() if name in KEPT_HEADERS}
        body = bytes(response.body).decode()
        await run_in_threadpool(workflow.remember, ctx, key, digest, response.status_code, headers, body)
        return response


async def request_hash(request: Request) -> str:
    """What the key stands for. Uploads count by address only: their multipart borders differ at each try."""
    digest = hashlib.sha256(f"{request.method} {request.url.path}?{request.url.query}\n".encode())
    if not request.headers.get("content-type", "").startswith("multipart/"):
        digest.update(await request.body())
    return digest.hexdigest()


def _lock(request: Request, key: str) -> asyncio.Lock:
    locks: weakref.WeakValueDictionary[str, asyncio.Lock] = request.app.state.idempotency_locks
    return locks.setdefault(key, asyncio.Lock())
