"""Alembic's entry: runs migrations on the connection it is given, or on the default data folder's database."""

from sqlalchemy import create_engine
from sqlmodel import SQLModel

from alembic import context
from app.settings import Settings
from app.storage import process_tables, tables

assert tables
assert process_tables  # imported for its metadata


def run(connection: object) -> None:
    """Migrate over `connection`, inside its transaction."""
    context.configure(
        connection=connection,
        target_metadata=SQLModel.metadata,
        render_as_batch=True,
        compare_type=True,
        compare_server_default=True,
    )
    context.run_migrations()


given = context.config.attributes.get("connection")
if given is not None:
    run(given)
else:
    with create_engine(f"sqlite:///{Settings().database}").begin() as fresh:
        run(fresh)
