"""SQLite engines: one for the single writer, one for short reads.

WAL and FULL: an acknowledged answer survives a power cut. The writer says BEGIN IMMEDIATE, because a transaction that
reads first and writes later fails at once when another one wrote in between, whatever the timeout.
"""

from pathlib import Path
from typing import Any

from sqlalchemy import Engine, event
from sqlmodel import create_engine

PRAGMAS = (
    "journal_mode=WAL",
    "synchronous=FULL",
    "busy_timeout=10000",
    "foreign_keys=ON",
    "trusted_schema=OFF",
    "temp_store=MEMORY",
)
READERS = 16


def open_engine(path: Path, *, write: bool) -> Engine:
    """One connection for the writer, a pool for readers; readers never checkpoint."""
    engine = create_engine(
        f"sqlite:///{path}", connect_args={"check_same_thread": False}, pool_size=1 if write else READERS, max_overflow=0
    )
    pragmas = PRAGMAS if write else (*PRAGMAS, "wal_autocheckpoint=0", "query_only=ON")

    @event.listens_for(engine, "connect")
    def connect(connection: Any, _record: Any) -> None:
        connection.isolation_level = None  # BEGIN is ours
        for pragma in pragmas:
            connection.execute(f"PRAGMA {pragma}")

    @event.listens_for(engine, "begin")
    def begin(connection: Any) -> None:
        connection.exec_driver_sql("BEGIN IMMEDIATE" if write else "BEGIN")

    return engine
