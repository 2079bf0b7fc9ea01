"""Server-sent events: everything that changes, from the outbox, with replay by Last-Event-ID."""

import asyncio
from collections.abc import AsyncIterator
from typing import Annotated, Any

from fastapi import APIRouter, Depends, Header, Query, Request
from fastapi.sse import EventSourceResponse, ServerSentEvent
from starlette.concurrency import run_in_threadpool

from app.api.dependencies import Ctx
from app.workflow import projects as workflow

router = APIRouter(tags=["events"])

MOST_WAITING = 256  # events a slow client may lag behind before it is told to start again
RETRY_MS = 2000


class Streams:
    """Hands the store's events to the open streams; lives in the event loop."""

    def __init__(self, store: Any, loop: asyncio.AbstractEventLoop) -> None:
        self._loop = loop
        self._queues: set[asyncio.Queue[Any]] = set()
        self._closed = False
        self._unsubscribe = store.subscribe(self._arrived)

    def _arrived(self, event: Any) -> None:
        """Called on the store's notifier thread."""
        if not self._closed:
            self._loop.call_soon_threadsafe(self._spread, event)

    def _spread(self, event: Any) -> None:
        for queue in self._queues:
            if queue.qsize() < MOST_WAITING:
                queue.put_nowait(event)
            else:
                _drain(queue)
                queue.put_nowait(None)

    def open(self) -> asyncio.Queue[Any]:
        """A queue of events from now on; None in it ends the stream."""
        queue: asyncio.Queue[Any] = asyncio.Queue()
        if self._closed:
            queue.put_nowait(None)
        self._queues.add(queue)
        return queue

    def drop(self, queue: asyncio.Queue[Any]) -> None:
        self._queues.discard(queue)

    @property
    def closed(self) -> bool:
        return self._closed

    def close(self) -> None:
        """End all streams; called in the loop when the server stops."""
        if not self._closed:
            self._closed = True
            self._unsubscribe()
            for queue in self._queues:
                queue.put_nowait(None)


def _drain(queue: asyncio.Queue[Any]) -> None:
    while not queue.empty():
        queue.get_nowait()


def known_project(
    ctx: Ctx, project: Annotated[str | None, Query(max_length=64, description="Only events of this project.")] = None
) -> str | None:
    """The project id asked for, after a look that it exists."""
    if project is not None:
        workflow.get_project(ctx, project)
    return project


@router.get("/events", response_class=EventSourceResponse)
async def stream_events(
    request: Request,
    ctx: Ctx,
    project: Annotated[str | None, Depends(known_project)],
    last_event_id: Annotated[str | None, Header(alias="Last-Event-ID", max_length=32)] = None,
) -> AsyncIterator[ServerSentEvent]:
    """A stream of changes. After a drop the browser repeats the last id by itself and misses nothing.

    An event `resync` says that this client fell behind or named an unknown id: read everything again.
    """
    streams: Streams = request.app.state.streams
    queue = streams.open()
    try:
        yield ServerSentEvent(comment="connected", retry=RETRY_MS)
        last = int(last_event_id) if last_event_id and last_event_id.isdigit() else 0
        missed = await run_in_threadpool(ctx.store.events_after, last, project) if last else []
        for event in missed:
            last = event.id
            yield _frame(event)
        while (event := await queue.get()) is not None:
            if event.id > last and project in (None, event.project_id):
                yield _frame(event)
        if not streams.closed:
            yield ServerSentEvent(event="resync", data={})
    finally:
        streams.drop(queue)


def _frame(event: Any) -> ServerSentEvent:
    return ServerSentEvent(event=event.type, id=str(event.id), data={"project_id": event.project_id, **event.data})
