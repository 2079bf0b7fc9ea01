"""Which features count in a project, own features, process templates"""

import sqlalchemy as sa
import sqlmodel

from alembic import op

revision = "0004"
down_revision = "0003"
branch_labels = None
depends_on = None

TEXT = sqlmodel.sql.sqltypes.AutoString()
LISTS, OBJECT = ("without", "own"), "levels"


def plain(name: str, default: str) -> sa.Column:
    return sa.Column(name, sa.JSON(none_as_null=True), nullable=False, server_default=default)


def upgrade() -> None:
    with op.batch_alter_table("project") as batch:
        batch.add_column(sa.Column("template", TEXT, nullable=True))
        for name in LISTS:
            batch.add_column(plain(name, "[]"))
        batch.add_column(plain(OBJECT, "{}"))
    with op.batch_alter_table("run") as batch:
        batch.add_column(sa.Column("features", TEXT, nullable=True))
    op.create_table(
        "own_feature",
        sa.Column("id", TEXT, nullable=False),
        sa.Column("key", TEXT, nullable=False),
        sa.Column("label", TEXT, nullable=False),
        sa.Column("source", TEXT, nullable=False),
        sa.Column("created_at", TEXT, nullable=False),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_own_feature")),
    )
    op.create_table(
        "process_template",
        sa.Column("id", TEXT, nullable=False),
        sa.Column("name", TEXT, nullable=False),
        sa.Column("why", TEXT, nullable=False),
        *(plain(name, "[]") for name in LISTS),
        sa.Column("interactions", sa.JSON(none_as_null=True), nullable=False),
        plain(OBJECT, "{}"),
        sa.Column("version", sa.Integer(), nullable=False),
        sa.Column("created_at", TEXT, nullable=False),
        sa.Column("deleted_at", TEXT, nullable=True),
        sa.CheckConstraint("length(name) BETWEEN 1 AND 200", name=op.f("ck_process_template_name")),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_process_template")),
    )


def downgrade() -> None:
    op.drop_table("process_template")
    op.drop_table("own_feature")
    with op.batch_alter_table("run") as batch:
        batch.drop_column("features")
    with op.batch_alter_table("project") as batch:
        batch.drop_column(OBJECT)
        for name in reversed(LISTS):
            batch.drop_column(name)
        batch.drop_column("template")
