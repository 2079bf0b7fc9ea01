"""Migrations make exactly the tables of the code, and are safe to run."""

import re
import sqlite3
from contextlib import closing
from pathlib import Path

import pytest
from sqlalchemy import create_engine
from sqlalchemy.exc import IntegrityError
from sqlalchemy.pool import NullPool
from sqlmodel import SQLModel

from alembic import command
from app.errors import Conflict
from app.settings import Settings
from app.storage import Store, migrate
from app.storage.migration import migration_config
from app.storage.tables import JobRow, Project


def parts(database: Path) -> dict[str, list[str]]:
    """Everything in the schema: per table or index its definitions in a fixed order, white space and quotes aside."""
    with closing(sqlite3.connect(database)) as connection:
        rows = connection.execute("SELECT name, sql FROM sqlite_master WHERE sql IS NOT NULL AND name != 'alembic_version'").fetchall()
    return {name: sorted(re.sub(r'[\s"]+', "", part) for part in definitions(sql)) for name, sql in rows}


def definitions(sql: str) -> list[str]:
    """What stands before, between and after the commas of the outermost parentheses."""
    depth, found = 0, [""]
    for sign in sql:
        depth += (sign == "(") - (sign == ")")
        if (sign, depth) in ((",", 1), ("(", 1), (")", 0)):
            found.append("")
        else:
            found[-1] += sign
    return found


def test_migrations_equal_the_tables(settings: Settings, tmp_path: Path) -> None:
    """`alembic check` is blind to CHECK constraints; comparing the schema itself is not."""
    migrate(settings)
    direct = tmp_path / "direct.db"
    SQLModel.metadata.create_all(create_engine(f"sqlite:///{direct}", poolclass=NullPool))
    migrated, made = parts(settings.database), parts(direct)
    assert migrated.keys() == made.keys()
    for name in made:
        assert migrated[name] == made[name], name
    assert any("CHECK" in part for part in made["run"])


def test_alembic_sees_no_difference(settings: Settings) -> None:
    migrate(settings)
    config = migration_config()
    with create_engine(f"sqlite:///{settings.database}", poolclass=NullPool).begin() as connection:
        config.attributes["connection"] = connection
        command.check(config)


def test_down_and_up_again(settings: Settings) -> None:
    migrate(settings)
    before = parts(settings.database)
    config = migration_config()
    with create_engine(f"sqlite:///{settings.database}", poolclass=NullPool).begin() as connection:
        config.attributes["connection"] = connection
        command.downgrade(config, "base")
        command.upgrade(config, "head")
    assert parts(settings.database) == before


def test_migrating_twice_keeps_the_rows(settings: Settings) -> None:
    migrate(settings)
    store = Store(settings)
    store.write(lambda session: session.add(Project(name="Kept", interactions=[])))
    store.close()
    migrate(settings)
    with closing(sqlite3.connect(settings.database)) as connection:
        assert connection.execute("SELECT name FROM project").fetchall() == [("Kept",)]


def test_a_newer_database_is_refused(settings: Settings) -> None:
    migrate(settings)
    with closing(sqlite3.connect(settings.database)) as connection, connection:
        connection.execute("UPDATE alembic_version SET version_num = '9999'")
    with pytest.raises(Conflict, match="newer version"):
        migrate(settings)


def test_checks_and_foreign_keys_hold(settings: Settings) -> None:
    """Table models don't validate; the database does."""
    migrate(settings)
    store = Store(settings)
    try:
        with pytest.raises(IntegrityError, match="ck_project_name"):
            store.write(lambda session: session.add(Project(name="", interactions=[])))
        with pytest.raises(IntegrityError, match="FOREIGN KEY"):
            store.write(lambda session: session.add(JobRow(project_id="none", kind="k", subject_id="s", title="t", args={})))
    finally:
        store.close()
