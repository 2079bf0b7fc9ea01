"""Edits of a segmentation, and the merge tree of a part"""

import sqlalchemy as sa
import sqlmodel

from alembic import op

revision = "0003"
down_revision = "0002"
branch_labels = None
depends_on = None

TEXT = sqlmodel.sql.sqltypes.AutoString()


def upgrade() -> None:
    with op.batch_alter_table("tool") as batch:
        batch.add_column(sa.Column("tree_sha", TEXT, nullable=True))
        batch.create_foreign_key(op.f("fk_tool_tree_sha_artifact"), "artifact", ["tree_sha"], ["sha"])
        batch.create_index(op.f("ix_tool_tree_sha"), ["tree_sha"])
    with op.batch_alter_table("segmentation") as batch:
        for name in ("parent_id", "redo_id"):
            batch.add_column(sa.Column(name, TEXT, nullable=True))
            batch.create_foreign_key(op.f(f"fk_segmentation_{name}_segmentation"), "segmentation", [name], ["id"])
            batch.create_index(op.f(f"ix_segmentation_{name}"), [name])
        batch.add_column(sa.Column("kind", TEXT, nullable=False, server_default="cut"))
        batch.add_column(sa.Column("words", TEXT, nullable=False, server_default="Read in"))
        for name in ("locked", "hidden"):
            batch.add_column(sa.Column(name, sa.JSON(none_as_null=True), nullable=False, server_default="[]"))


def downgrade() -> None:
    with op.batch_alter_table("segmentation") as batch:
        for name in ("hidden", "locked", "words", "kind"):
            batch.drop_column(name)
        for name in ("redo_id", "parent_id"):
            batch.drop_index(op.f(f"ix_segmentation_{name}"))
            batch.drop_constraint(op.f(f"fk_segmentation_{name}_segmentation"), type_="foreignkey")
            batch.drop_column(name)
    with op.batch_alter_table("tool") as batch:
        batch.drop_index(op.f("ix_tool_tree_sha"))
        batch.drop_constraint(op.f("fk_tool_tree_sha_artifact"), type_="foreignkey")
        batch.drop_column("tree_sha")
