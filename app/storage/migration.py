"""Bringing a database to this version's tables: under a file lock, with a backup when there is something to lose."""

import fcntl
import sqlite3
from collections.abc import Iterator
from contextlib import closing, contextmanager
from pathlib import Path

from alembic.config import Config
from alembic.runtime.migration import MigrationContext
from alembic.script import ScriptDirectory
from alembic.util import CommandError
from sqlalchemy import create_engine
from sqlalchemy.pool import NullPool

from alembic import command
from app.errors import Conflict
from app.settings import ROOT, Settings


def migration_config() -> Config:
    """Alembic's settings; there is no alembic.ini."""
    config = Config()
    config.set_main_option("script_location", str(ROOT / "alembic").replace("%", "%%"))
    return config


def migrate(settings: Settings) -> None:
    """Upgrade the database to the newest revision; does nothing when it is there already.

    Raises:
        Conflict: The database was written by a newer version.
    """
    settings.data.mkdir(parents=True, exist_ok=True)
    config = migration_config()
    scripts = ScriptDirectory.from_config(config)
    with _locked(settings.data / "migrate.lock"):
        current = current_revision(settings.database)
        if current == scripts.get_current_head():
            return
        if current is not None:
            _check_known(scripts, current, settings.database)
            _back_up(settings.database, current)
        _upgrade(settings.database, config)


def current_revision(database: Path) -> str | None:
    """The revision a database is at, None for a new one."""
    if not database.exists():
        return None
    engine = create_engine(f"sqlite:///{database}", poolclass=NullPool)
    with engine.connect() as connection:
        return MigrationContext.configure(connection).get_current_revision()


def _check_known(scripts: ScriptDirectory, revision: str, database: Path) -> None:
    try:
        scripts.get_revision(revision)
    except CommandError:
        message = (
            f"{database} was written by a newer version of Apprentice (revision {revision}). Use that version, or another data folder."
        )
        raise Conflict(message) from None


def _back_up(database: Path, revision: str) -> None:
    """A copy through SQLite's own backup, complete even with a write-ahead log beside the file."""
    target = database.with_name(f"{database.stem}-before-{revision}.db")
    with closing(sqlite3.connect(database)) as source, closing(sqlite3.connect(target)) as copy:
        source.backup(copy)


def _upgrade(database: Path, config: Config) -> None:
    """One transaction with foreign keys off: a table that is rebuilt would otherwise delete its children's rows."""
    engine = create_engine(f"sqlite:///{database}", poolclass=NullPool)
    with engine.connect() as connection:
        connection.exec_driver_sql("PRAGMA foreign_keys=OFF")
        connection.exec_driver_sql("PRAGMA journal_mode=WAL")
        connection.rollback()
        with connection.begin():
            connection.exec_driver_sql("BEGIN IMMEDIATE")
            config.attributes["connection"] = connection
            command.upgrade(config, "head")
            broken = connection.exec_driver_sql("PRAGMA foreign_key_check").fetchall()
            if broken:
                raise RuntimeError(f"The migration would leave rows without their parents: {broken[:5]}")


@contextmanager
def _locked(path: Path) -> Iterator[None]:
    """Hold an exclusive lock that other processes respect; gone with the process."""
    with path.open("w") as file:
        fcntl.flock(file, fcntl.LOCK_EX)
        yield
