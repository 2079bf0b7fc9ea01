"""The single writer thread with group commit: a SAVEPOINT per request, one COMMIT (one fsync) per batch."""

import queue
import threading
from collections.abc import Callable
from concurrent.futures import Future
from typing import Any

from sqlalchemy import Engine
from sqlmodel import Session

from app.storage.outbox import Event, events_of

BATCH = 64


class TransactionLost(Exception):
    """SQLite rolled the batch back by itself (disk full, I/O error): nothing of it was stored."""


class StoreClosed(Exception):
    """The store was closed while the request waited."""


Work = tuple[Callable[[Session], Any], "Future[Any]"]


class Writer:
    """Runs functions of a session one after the other on its own thread."""

    def __init__(self, engine: Engine, committed: Callable[[list[Event]], None]) -> None:
        self._engine = engine
        self._committed = committed
        self._queue: queue.SimpleQueue[Work | None] = queue.SimpleQueue()
        self._closed = threading.Event()
        self._lock = threading.Lock()
        self.commits = 0
        self._thread = threading.Thread(target=self._run, name="writer", daemon=True)
        self._thread.start()

    def submit(self, function: Callable[[Session], Any]) -> "Future[Any]":
        """Queue a write; the future is done once its batch is committed. One cancelled while queued is skipped."""
        if threading.current_thread() is self._thread:
            raise RuntimeError("A write was started from within a write.")
        future: Future[Any] = Future()
        with self._lock:
            if self._closed.is_set():
                raise StoreClosed
            self._queue.put((function, future))
        return future

    def close(self) -> None:
        """Finish what is queued, then end the thread."""
        with self._lock:
            if not self._closed.is_set():
                self._closed.set()
                self._queue.put(None)
        self._thread.join()

    def _run(self) -> None:
        while True:
            item = self._queue.get()
            batch: list[Work] = []
            while item is not None:
                if item[1].set_running_or_notify_cancel():  # a cancelled future would refuse its result and end this thread
                    batch.append(item)
                if len(batch) >= BATCH:
                    break
                try:
                    item = self._queue.get_nowait()
                except queue.Empty:
                    break
            if batch:
                self._store(batch)
            if item is None:
                return

    def _store(self, batch: list[Work]) -> None:
        results: list[tuple[Any, BaseException | None]] = []
        events: list[Event] = []
        try:
            with self._engine.connect() as connection, connection.begin():
                driver = connection.connection.dbapi_connection
                for function, _ in batch:
                    value, error, told = _attempt(connection, function)
                    results.append((value, error))
                    events += told
                    if not driver.in_transaction:  # pyright: ignore[reportOptionalMemberAccess, reportAttributeAccessIssue]
                        raise TransactionLost("The database gave up the transaction; nothing was stored.") from error
            self.commits += 1
        except Exception as error:  # noqa: BLE001 - the worker loop: every caller gets it
            results, events = [(None, error)] * len(batch), []
        if events:
            self._committed(events)
        for (_, future), (value, error) in zip(batch, results, strict=True):
            if error is None:
                future.set_result(value)
            else:
                future.set_exception(error)


def _attempt(connection: Any, function: Callable[[Session], Any]) -> tuple[Any, BaseException | None, list[Event]]:
    """Run one request in a savepoint of its own."""
    try:
        with Session(connection, join_transaction_mode="create_savepoint", expire_on_commit=False) as session:
            value = function(session)
            session.commit()
            return value, None, events_of(session)
    except Exception as error:  # noqa: BLE001 - handed to the caller
        return None, error, []
