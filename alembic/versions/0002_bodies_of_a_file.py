"""Bodies of a file"""

import sqlalchemy as sa
import sqlmodel

from alembic import op

revision = "0002"
down_revision = "0001"
branch_labels = None
depends_on = None


def upgrade() -> None:
    with op.batch_alter_table("tool") as batch:
        batch.add_column(sa.Column("body", sqlmodel.sql.sqltypes.AutoString(), nullable=True))
        batch.add_column(sa.Column("bodies", sa.JSON(none_as_null=True), nullable=True))
        batch.add_column(sa.Column("parsed_sha", sqlmodel.sql.sqltypes.AutoString(), nullable=True))
        batch.create_foreign_key(op.f("fk_tool_parsed_sha_artifact"), "artifact", ["parsed_sha"], ["sha"])
        batch.create_index(op.f("ix_tool_parsed_sha"), ["parsed_sha"])


def downgrade() -> None:
    with op.batch_alter_table("tool") as batch:
        batch.drop_index(op.f("ix_tool_parsed_sha"))
        batch.drop_constraint(op.f("fk_tool_parsed_sha_artifact"), type_="foreignkey")
        for name in ("parsed_sha", "bodies", "body"):
            batch.drop_column(name)
