"""The dispatcher: one thread that starts queued jobs, stores their results and puts interrupted ones back.

A job is prepared from the database, computed as a pure function elsewhere, and finished in one transaction. So it can be
computed again at any time: after a restart, after a worker died. A result whose job is no longer running is dropped.
"""

import logging
import queue
import threading
from collections.abc import Callable
from concurrent.futures import Future
from dataclasses import dataclass
from typing import Any

from sqlmodel import Session, col, select

from app.errors import AppError
from app.jobs.executors import BrokenProcessPool, Compute, Ticket, runner_for
from app.jobs.rows import UNFINISHED, tell
from app.settings import Settings
from app.storage import Event, Store
from app.storage.identity import now
from app.storage.tables import JobRow

log = logging.getLogger(__name__)

MOST_ATTEMPTS = 3
GENERIC = "Something went wrong inside Apprentice while this was computed. The server's log has the details; it can be tried again."
LOST = "The computation was ended from outside three times, perhaps for lack of memory."


@dataclass(frozen=True)
class Handler:
    """How one kind of job is done."""

    prepare: Callable[[Session, JobRow], Any]  # picklable arguments; None when the subject is gone
    compute: Compute  # importable and pure: (arguments, report) -> output
    finish: Callable[[Session, JobRow, Any], None]
    fail: Callable[[Session, JobRow, dict[str, str]], None]  # tell the subject
    begin: Callable[[Session, JobRow], None] = lambda _session, _job: None  # tell the subject that work starts


class Jobs:
    """The queue and its thread. Register handlers, then start."""

    def __init__(self, store: Store, settings: Settings, warm_up: tuple[str, ...] = ()) -> None:
        self.store = store
        self._settings = settings
        self._warm_up = warm_up
        self._handlers: dict[str, Handler] = {}
        self._mailbox: queue.SimpleQueue[tuple[str, Any]] = queue.SimpleQueue()
        self._running: dict[Ticket, str] = {}  # ticket -> kind
        self._idle = threading.Condition()
        self._closing = False
        self._broken = False  # the pool lost a process and is not built anew yet

    def register(self, kind: str, handler: Handler) -> None:
        """Say how a kind of job is done."""
        self._handlers[kind] = handler

    def start(self) -> None:
        """Put back what a stopped server left running, then work."""
        self._closing, self._mailbox = False, queue.SimpleQueue()
        self.store.write(_requeue)
        self._runner = runner_for(self._settings.executor, self._progress, self._warm_up)
        self._unsubscribe = self.store.subscribe(self._heard)
        self._thread = threading.Thread(target=self._run, name="dispatcher", daemon=True)
        self._thread.start()
        self._mailbox.put(("look", None))

    def close(self) -> None:
        """Stop; unfinished jobs go on at the next start."""
        self._closing = True
        self._unsubscribe()
        self._mailbox.put(("stop", None))
        self._runner.close()
        self._thread.join()

    def wait_idle(self, seconds: float) -> bool:
        """Wait until no job is queued or running; False when the time is over first."""
        with self._idle:
            return self._idle.wait_for(lambda: self.store.read(_nothing_to_do), seconds)

    def _heard(self, event: Event) -> None:
        if event.type == "job.progress" and event.data["state"] in ("queued", "cancelled"):
            self._mailbox.put(("look", None))

    def _progress(self, ticket: Ticket, fraction: float, message: str) -> None:
        if not self._closing:
            self.store.write(lambda session: _note_progress(session, ticket, fraction, message))

    def _run(self) -> None:
        while True:
            what, value = self._mailbox.get()
            if what == "stop" or self._closing:
                return
            try:
                if what == "done":
                    self._finish(*value)
                self._start_queued()
            except Exception:
                log.exception("The dispatcher failed on %s", what)
            with self._idle:
                self._idle.notify_all()

    def _start_queued(self) -> None:
        while len(self._running) < self._runner.slots and not self._closing and not self._broken:
            if not self.store.read(_next_queued):  # spares a commit
                return
            job = self.store.write(lambda session: _claim(session, self._handlers))
            if job is not None:
                self._start(job)

    def _start(self, job: JobRow) -> None:
        ticket = (job.id, job.attempt)
        handler = self._handlers.get(job.kind)
        try:
            if handler is None:
                raise LookupError(f"no handler for jobs of kind {job.kind}")
            args = self.store.read(lambda session: handler.prepare(session, job))
        except Exception as error:  # noqa: BLE001 - the worker loop
            self._fail(ticket, job.kind, error)
            return
        if args is None:
            self.store.write(lambda session: _cancel(session, ticket))
            return
        self._running[ticket] = job.kind
        try:
            future = self._runner.submit(handler.compute, ticket, args)
        except BrokenProcessPool as error:
            future = Future()
            future.set_exception(error)
        future.add_done_callback(lambda done: self._mailbox.put(("done", (ticket, done))))

    def _finish(self, ticket: Ticket, future: "Future[Any]") -> None:
        kind = self._running.pop(ticket)
        if future.cancelled():
            return
        error = future.exception()
        if isinstance(error, BrokenProcessPool):
            self._recover(ticket, kind)
        elif error is not None:
            self._fail(ticket, kind, error)
        else:
            handler, output = self._handlers[kind], future.result()
            try:
                self.store.write(lambda session: _complete(session, ticket, handler, output))
            except Exception as problem:  # noqa: BLE001 - the worker loop
                self._fail(ticket, kind, problem)

    def _recover(self, ticket: Ticket, kind: str) -> None:
        """A worker died: build a new pool and try again, three times at most."""
        log.warning("A worker process ended during job %s", ticket[0])
        self._broken = bool(self._running)  # until the last of the broken pool's jobs is here
        if not self._broken:
            self._runner.rebuild()
        if ticket[1] >= MOST_ATTEMPTS:
            self._fail(ticket, kind, AppError(LOST))
        else:
            self.store.write(lambda session: _put_back(session, ticket))

    def _fail(self, ticket: Ticket, kind: str, error: BaseException) -> None:
        if isinstance(error, AppError):
            told = {"error": type(error).__name__, "detail": str(error)}
        else:
            log.error("Job %s (%s) failed", ticket[0], kind, exc_info=error)
            told = {"error": "InternalError", "detail": GENERIC}
        handler = self._handlers.get(kind)
        self.store.write(lambda session: _note_failure(session, ticket, handler, told))


def _requeue(session: Session) -> None:
    for row in session.exec(select(JobRow).where(JobRow.state == "running")):
        row.state, row.started_at = "queued", None
        session.add(row)


def _nothing_to_do(session: Session) -> bool:
    return session.exec(select(JobRow.id).where(col(JobRow.state).in_(UNFINISHED)).limit(1)).first() is None


def _next_queued(session: Session) -> JobRow | None:
    return session.exec(select(JobRow).where(JobRow.state == "queued").order_by(col(JobRow.id)).limit(1)).first()


def _claim(session: Session, handlers: dict[str, Handler]) -> JobRow | None:
    """Take the oldest queued job; the row is returned detached."""
    row = _next_queued(session)
    if row is not None:
        row.state, row.attempt, row.started_at = "running", row.attempt + 1, now()
        session.add(row)
        if row.kind in handlers:
            handlers[row.kind].begin(session, row)
        tell(session, row)
    return row


def _current(session: Session, ticket: Ticket) -> JobRow | None:
    """The row, if this attempt of it is still wanted."""
    row = session.get(JobRow, ticket[0])
    return row if row is not None and row.state == "running" and row.attempt == ticket[1] else None


def _note_progress(session: Session, ticket: Ticket, fraction: float, message: str) -> None:
    row = _current(session, ticket)
    if row is not None:
        row.fraction, row.message = min(max(fraction, 0.0), 1.0), message
        session.add(row)
        tell(session, row)


def _complete(session: Session, ticket: Ticket, handler: Handler, output: Any) -> None:
    row = _current(session, ticket)
    if row is not None:
        row.state, row.fraction, row.finished_at = "done", 1.0, now()
        session.add(row)
        handler.finish(session, row, output)
        tell(session, row)


def _note_failure(session: Session, ticket: Ticket, handler: Handler | None, told: dict[str, str]) -> None:
    row = _current(session, ticket)
    if row is not None:
        row.state, row.error, row.finished_at = "failed", told, now()
        session.add(row)
        if handler is not None:
            handler.fail(session, row, told)
        tell(session, row)


def _cancel(session: Session, ticket: Ticket) -> None:
    row = _current(session, ticket)
    if row is not None:
        row.state, row.finished_at = "cancelled", now()
        session.add(row)
        tell(session, row)


def _put_back(session: Session, ticket: Ticket) -> None:
    row = _current(session, ticket)
    if row is not None:
        row.state, row.started_at = "queued", None
        session.add(row)
        tell(session, row)
