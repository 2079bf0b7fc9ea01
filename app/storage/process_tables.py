"""Tables of what counts: features that engineers wrote, and process templates they saved."""

from sqlalchemy import CheckConstraint
from sqlmodel import Field, SQLModel

from app.storage.columns import json_column, list_column, object_column
from app.storage.identity import new_id, now
from app.storage.tables import Json


class OwnFeatureRow(SQLModel, table=True):
    """A feature that an engineer wrote, kept as it was when it was switched on: policies go on using that text."""

    __tablename__ = "own_feature"  # pyright: ignore[reportAssignmentType]
    id: str = Field(primary_key=True)  # "key@version"
    key: str
    label: str
    source: str
    created_at: str = Field(default_factory=now)


class ProcessTemplateRow(SQLModel, table=True):
    """A process template that an engineer saved."""

    __tablename__ = "process_template"  # pyright: ignore[reportAssignmentType]
    __table_args__ = (CheckConstraint("length(name) BETWEEN 1 AND 200", name="name"),)
    id: str = Field(default_factory=new_id, primary_key=True)
    name: str
    why: str
    without: list[str] = list_column()
    own: list[str] = list_column()
    interactions: list[dict[str, str]] = json_column()
    levels: Json = object_column()
    version: int = 1
    created_at: str = Field(default_factory=now)
    deleted_at: str | None = None
