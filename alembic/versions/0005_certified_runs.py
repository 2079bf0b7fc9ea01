"""Certified runs: a mode, tools of interest, questions about tools nobody demonstrated, certificates"""

import sqlalchemy as sa
import sqlmodel

from alembic import op

revision = "0005"
down_revision = "0004"
branch_labels = None
depends_on = None

TEXT = sqlmodel.sql.sqltypes.AutoString()
KINDS = ("'similarity', 'preference'", "'similarity', 'preference', 'pair'")
VALUES = (
    "'similar', 'not_similar', 'cant_tell', 'left', 'right', 'equal', 'undone'",
    "'similar', 'not_similar', 'cant_tell', 'left', 'right', 'equal', 'both_wrong', 'undone'",
)


def allow(batch: object, table: str, column: str, values: str) -> None:
    name = op.f(f"ck_{table}_{column}")
    batch.drop_constraint(name, type_="check")  # type: ignore[attr-defined]
    batch.create_check_constraint(name, f"{column} IN ({values})")  # type: ignore[attr-defined]


def upgrade() -> None:
    with op.batch_alter_table("run") as batch:
        batch.add_column(sa.Column("mode", TEXT, nullable=False, server_default="paper"))  # what runs so far were
        batch.add_column(sa.Column("interest", sa.JSON(none_as_null=True), nullable=False, server_default="[]"))
        batch.create_check_constraint(op.f("ck_run_mode"), "mode IN ('certified', 'paper')")
    with op.batch_alter_table("run_checkpoint") as batch:
        batch.add_column(sa.Column("report", sa.JSON(none_as_null=True), nullable=True))
    with op.batch_alter_table("policy") as batch:
        batch.add_column(sa.Column("certificate", sa.JSON(none_as_null=True), nullable=True))
    with op.batch_alter_table("query") as batch:
        batch.alter_column("demonstration_id", existing_type=TEXT, nullable=True)
        allow(batch, "query", "kind", KINDS[1])
    with op.batch_alter_table("answer") as batch:
        allow(batch, "answer", "value", VALUES[1])


def downgrade() -> None:
    op.execute("DELETE FROM answer WHERE value = 'both_wrong' OR query_id IN (SELECT id FROM query WHERE kind = 'pair')")
    op.execute("DELETE FROM query WHERE kind = 'pair'")
    with op.batch_alter_table("answer") as batch:
        allow(batch, "answer", "value", VALUES[0])
    with op.batch_alter_table("query") as batch:
        allow(batch, "query", "kind", KINDS[0])
        batch.alter_column("demonstration_id", existing_type=TEXT, nullable=False)
    with op.batch_alter_table("policy") as batch:
        batch.drop_column("certificate")
    with op.batch_alter_table("run_checkpoint") as batch:
        batch.drop_column("report")
    with op.batch_alter_table("run") as batch:
        batch.drop_constraint(op.f("ck_run_mode"), type_="check")
        batch.drop_column("interest")
        batch.drop_column("mode")
