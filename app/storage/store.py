"""The store: reads in short sessions, writes through one thread, files beside the database, events after the commit."""

from collections.abc import Callable
from datetime import UTC, datetime, timedelta
from typing import TypeVar

from sqlmodel import Session, col, delete, select

from app.settings import Settings
from app.storage.artifacts import Artifacts
from app.storage.engine import open_engine
from app.storage.outbox import Event, Notifier, as_event
from app.storage.tables import EventRow, Idempotency
from app.storage.writer import Writer

T = TypeVar("T")

KEPT_DAYS = 7  # events and idempotency keys


class Store:
    """Opens a migrated database."""

    def __init__(self, settings: Settings) -> None:
        self.artifacts = Artifacts(settings.artifacts)
        self._write_engine = open_engine(settings.database, write=True)
        self._read_engine = open_engine(settings.database, write=False)
        self._notifier = Notifier()
        self.writer = Writer(self._write_engine, self._notifier.committed)
        self.write(_forget_old)

    def read(self, function: Callable[[Session], T]) -> T:
        """Run `function` in a read transaction; it returns plain values, not rows."""
        with Session(self._read_engine) as session:
            return function(session)

    def write(self, function: Callable[[Session], T]) -> T:
        """Run `function` in the next write batch and wait for its commit; its errors are raised here."""
        return self.writer.submit(function).result()

    def subscribe(self, callback: Callable[[Event], None]) -> Callable[[], None]:
        """Call `callback` after each commit for each event; it must not block. The result unsubscribes."""
        return self._notifier.subscribe(callback)

    def events_after(self, after: int, project_id: str | None = None) -> list[Event]:
        """Events with a higher id, oldest first, of one project or all."""

        def query(session: Session) -> list[Event]:
            wanted = select(EventRow).where(col(EventRow.id) > after).order_by(col(EventRow.id))
            if project_id is not None:
                wanted = wanted.where(EventRow.project_id == project_id)
            return [as_event(row) for row in session.exec(wanted)]

        return self.read(query)

    def close(self) -> None:
        """Finish queued writes, tell of them, close all connections."""
        self.writer.close()
        self._notifier.close()
        self._write_engine.dispose()
        self._read_engine.dispose()


def _forget_old(session: Session) -> None:
    limit = (datetime.now(UTC) - timedelta(days=KEPT_DAYS)).isoformat(timespec="milliseconds")
    session.exec(delete(EventRow).where(col(EventRow.created_at) < limit))
    session.exec(delete(Idempotency).where(col(Idempotency.created_at) < limit))
