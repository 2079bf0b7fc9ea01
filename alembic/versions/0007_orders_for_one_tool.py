"""Runs about one tool, their questions and answers, and the orders they find"""

import sqlalchemy as sa
import sqlmodel

from alembic import op

revision = "0007"
down_revision = "0006"
branch_labels = None
depends_on = None

TEXT = sqlmodel.sql.sqltypes.AutoString()
OWNERS = (("project_id", "project"), ("tool_id", "tool"), ("segmentation_id", "segmentation"), ("run_id", "run"))
RUNS = ("'performance', 'effort'", "'performance', 'effort', 'exception'")
QUERIES = ("'similarity', 'preference', 'pair'", "'similarity', 'preference', 'pair', 'closer'")
ANSWERS = (
    "'similar', 'not_similar', 'cant_tell', 'left', 'right', 'equal', 'both_wrong', 'undone'",
    "'similar', 'not_similar', 'cant_tell', 'left', 'right', 'equal', 'both_wrong', 'left_mine', 'right_mine', 'undone'",
)


def allow(table: str, column: str, values: str) -> None:
    name = op.f(f"ck_{table}_{column}")
    with op.batch_alter_table(table) as batch:
        batch.drop_constraint(name, type_="check")
        batch.create_check_constraint(name, f"{column} IN ({values})")


def upgrade() -> None:
    allow("run", "kind", RUNS[1])
    allow("query", "kind", QUERIES[1])
    allow("answer", "value", ANSWERS[1])
    op.create_table(
        "tool_exception",
        sa.Column("id", TEXT, nullable=False),
        sa.Column("project_id", TEXT, nullable=False),
        sa.Column("tool_id", TEXT, nullable=False),
        sa.Column("segmentation_id", TEXT, nullable=False),
        sa.Column("run_id", TEXT, nullable=False),
        sa.Column("sequence", sa.JSON(none_as_null=True), nullable=False),
        sa.Column("answers", sa.Integer(), nullable=False),
        sa.Column("probability", sa.Float(), nullable=False),
        sa.Column("created_at", TEXT, nullable=False),
        sa.Column("dropped_at", TEXT, nullable=True),
        *(sa.ForeignKeyConstraint([column], [f"{table}.id"], name=op.f(f"fk_tool_exception_{column}_{table}")) for column, table in OWNERS),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_tool_exception")),
    )
    with op.batch_alter_table("tool_exception") as batch:
        for column, _ in OWNERS:
            batch.create_index(op.f(f"ix_tool_exception_{column}"), [column], unique=False)


def downgrade() -> None:
    op.drop_table("tool_exception")
    op.execute("DELETE FROM answer WHERE query_id IN (SELECT id FROM query WHERE kind = 'closer')")
    op.execute("DELETE FROM query WHERE kind = 'closer'")
    for table in ("run_demonstration", "run_checkpoint", "metric"):
        op.execute(f"DELETE FROM {table} WHERE run_id IN (SELECT id FROM run WHERE kind = 'exception')")
    op.execute("DELETE FROM run WHERE kind = 'exception'")
    allow("answer", "value", ANSWERS[0])
    allow("query", "kind", QUERIES[0])
    allow("run", "kind", RUNS[0])
