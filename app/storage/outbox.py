"""The outbox: events are rows written with the change they tell of, and are handed out after the commit."""

import logging
import queue
import threading
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from sqlmodel import Session

from app.storage.tables import EventRow

log = logging.getLogger(__name__)
KEY = "events"


@dataclass(frozen=True)
class Event:
    """Something that changed."""

    id: int
    project_id: str | None
    type: str
    data: dict[str, Any]


def emit(session: Session, type: str, project_id: str | None, **data: Any) -> None:
    """Tell of a change in the transaction that makes it."""
    row = EventRow(type=type, project_id=project_id, data=data)
    session.add(row)
    session.info.setdefault(KEY, []).append(row)


def events_of(session: Session) -> list[Event]:
    """What a committed session has emitted."""
    return [as_event(row) for row in session.info.get(KEY, [])]


def as_event(row: EventRow) -> Event:
    """The row as a value."""
    assert row.id is not None
    return Event(row.id, row.project_id, row.type, row.data)


class Notifier:
    """Calls subscribers on a thread of its own, in the order of the events."""

    def __init__(self) -> None:
        self._queue: queue.SimpleQueue[list[Event] | None] = queue.SimpleQueue()
        self._subscribers: dict[int, Callable[[Event], None]] = {}
        self._lock = threading.Lock()
        self._next = 0
        self._thread = threading.Thread(target=self._run, name="notifier", daemon=True)
        self._thread.start()

    def subscribe(self, callback: Callable[[Event], None]) -> Callable[[], None]:
        """Call `callback` for each event from now on; the result ends that."""
        with self._lock:
            self._next += 1
            key = self._next
            self._subscribers[key] = callback

        def unsubscribe() -> None:
            with self._lock:
                self._subscribers.pop(key, None)

        return unsubscribe

    def committed(self, events: list[Event]) -> None:
        """Hand over the events of a committed batch."""
        self._queue.put(events)

    def close(self) -> None:
        self._queue.put(None)
        self._thread.join()

    def _run(self) -> None:
        while (events := self._queue.get()) is not None:
            with self._lock:
                callbacks = list(self._subscribers.values())
            for event in events:
                for callback in callbacks:
                    try:
                        callback(event)
                    except Exception:
                        log.exception("A subscriber failed on %s", event.type)
