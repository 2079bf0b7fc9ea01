"""Kinds of columns that several tables have, and how constraints are named."""

from typing import Any

from sqlalchemy import JSON, CheckConstraint, Column, ForeignKey
from sqlmodel import Field, SQLModel

SQLModel.metadata.naming_convention = {
    "ix": "ix_%(column_0_label)s",
    "uq": "uq_%(table_name)s_%(column_0_name)s",
    "ck": "ck_%(table_name)s_%(constraint_name)s",
    "fk": "fk_%(table_name)s_%(column_0_name)s_%(referred_table_name)s",
    "pk": "pk_%(table_name)s",
}


def one_of(column: str, *values: str) -> CheckConstraint:
    """CHECK that a text column holds one of `values`."""
    listed = ", ".join(f"'{value}'" for value in values)
    return CheckConstraint(f"{column} IN ({listed})", name=column)


def json_column(nullable: bool = False) -> Any:
    """A JSON column; None becomes SQL NULL."""
    return Field(default=None, sa_column=Column(JSON(none_as_null=True), nullable=nullable))


def list_column() -> Any:
    """A JSON column that starts as []."""
    return Field(default_factory=list, sa_column=Column(JSON(none_as_null=True), nullable=False, server_default="[]"))


def object_column() -> Any:
    """A JSON column that starts as {}."""
    return Field(default_factory=dict, sa_column=Column(JSON(none_as_null=True), nullable=False, server_default="{}"))


def owned(target: str, nullable: bool = False) -> Any:
    """A foreign key with an index."""
    return Field(default=None, sa_column=Column(ForeignKey(target), nullable=nullable, index=True))
