"""First tables"""

import sqlalchemy as sa
import sqlmodel

from alembic import op

revision = "0001"
down_revision = None
branch_labels = None
depends_on = None


def upgrade() -> None:
    op.create_table(
        "artifact",
        sa.Column("sha", sqlmodel.sql.sqltypes.AutoString(), nullable=False),
        sa.Column("size", sa.Integer(), nullable=False),
        sa.Column("media_type", sqlmodel.sql.sqltypes.AutoString(), nullable=False),
        sa.Column("created_at", sqlmodel.sql.sqltypes.AutoString(), nullable=False),
        sa.CheckConstraint("length(sha) = 64", name=op.f("ck_artifact_sha")),
        sa.CheckConstraint("size >= 0", name=op.f("ck_artifact_size")),
        sa.PrimaryKeyConstraint("sha", name=op.f("pk_artifact")),
    )
    op.create_table(
        "event",
        sa.Column("id", sa.Integer(), nullable=False),
        sa.Column("project_id", sqlmodel.sql.sqltypes.AutoString(), nullable=True),
        sa.Column("type", sqlmodel.sql.sqltypes.AutoString(), nullable=False),
        sa.Column("data", sa.JSON(none_as_null=True), nullable=False),
        sa.Column("created_at", sqlmodel.sql.sqltypes.AutoString(), nullable=False),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_event")),
        sqlite_autoincrement=True,
    )
    with op.batch_alter_table("event", schema=None) as batch_op:
        batch_op.create_index(batch_op.f("ix_event_created_at"), ["created_at"], unique=False)
        batch_op.create_index(batch_op.f("ix_event_project_id"), ["project_id"], unique=False)

    op.create_table(
        "idempotency",
        sa.Column("key", sqlmodel.sql.sqltypes.AutoString(), nullable=False),
        sa.Column("request_hash", sqlmodel.sql.sqltypes.AutoString(), nullable=False),
        sa.Column("status", sa.Integer(), nullable=False),
        sa.Column("headers", sa.JSON(none_as_null=True), nullable=False),
        sa.Column("body", sqlmodel.sql.sqltypes.AutoString(), nullable=False),
        sa.Column("created_at", sqlmodel.sql.sqltypes.AutoString(), nullable=False),
        sa.PrimaryKeyConstraint("key", name=op.f("pk_idempotency")),
    )
    op.create_table(
        "project",
        sa.Column("id", sqlmodel.sql.sqltypes.AutoString(), nullable=False),
        sa.Column("name", sqlmodel.sql.sqltypes.AutoString(), nullable=False),
        sa.Column("process", sqlmodel.sql.sqltypes.AutoString(), nullable=False),
        sa.Column("sample", sa.Boolean(), nullable=False),
        sa.Column("interactions", sa.JSON(none_as_null=True), nullable=False),
        sa.Column("version", sa.Integer(), nullable=False),
        sa.Column("created_at", sqlmodel.sql.sqltypes.AutoString(), nullable=False),
        sa.Column("updated_at", sqlmodel.sql.sqltypes.AutoString(), nullable=False),
        sa.Column("deleted_at", sqlmodel.sql.sqltypes.AutoString(), nullable=True),
        sa.CheckConstraint("length(name) BETWEEN 1 AND 200", name=op.f("ck_project_name")),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_project")),
    )
    op.create_table(
        "job",
        sa.Column("id", sqlmodel.sql.sqltypes.AutoString(), nullable=False),
        sa.Column("project_id", sqlmodel.sql.sqltypes.AutoString(), nullable=False),
        sa.Column("kind", sqlmodel.sql.sqltypes.AutoString(), nullable=False),
        sa.Column("subject_id", sqlmodel.sql.sqltypes.AutoString(), nullable=False),
        sa.Column("title", sqlmodel.sql.sqltypes.AutoString(), nullable=False),
        sa.Column("args", sa.JSON(none_as_null=True), nullable=False),
        sa.Column("state", sqlmodel.sql.sqltypes.AutoString(), nullable=False),
        sa.Column("fraction", sa.Float(), nullable=False),
        sa.Column("message", sqlmodel.sql.sqltypes.AutoString(), nullable=False),
        sa.Column("error", sa.JSON(none_as_null=True), nullable=True),
        sa.Column("attempt", sa.Integer(), nullable=False),
        sa.Column("created_at", sqlmodel.sql.sqltypes.AutoString(), nullable=False),
        sa.Column("started_at", sqlmodel.sql.sqltypes.AutoString(), nullable=True),
        sa.Column("finished_at", sqlmodel.sql.sqltypes.AutoString(), nullable=True),
        sa.CheckConstraint("state IN ('queued', 'running', 'done', 'failed', 'cancelled')", name=op.f("ck_job_state")),
        sa.CheckConstraint("fraction BETWEEN 0 AND 1", name=op.f("ck_job_fraction")),
        sa.ForeignKeyConstraint(["project_id"], ["project.id"], name=op.f("fk_job_project_id_project")),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_job")),
    )
    with op.batch_alter_table("job", schema=None) as batch_op:
        batch_op.create_index(batch_op.f("ix_job_project_id"), ["project_id"], unique=False)
        batch_op.create_index("ix_job_queue", ["state", "id"], unique=False)
        batch_op.create_index(batch_op.f("ix_job_subject_id"), ["subject_id"], unique=False)

    op.create_table(
        "run",
        sa.Column("id", sqlmodel.sql.sqltypes.AutoString(), nullable=False),
        sa.Column("project_id", sqlmodel.sql.sqltypes.AutoString(), nullable=False),
        sa.Column("kind", sqlmodel.sql.sqltypes.AutoString(), nullable=False),
        sa.Column("state", sqlmodel.sql.sqltypes.AutoString(), nullable=False),
        sa.Column("round", sa.Integer(), nullable=False),
        sa.Column("iteration", sa.Integer(), nullable=False),
        sa.Column("seed", sa.Integer(), nullable=False),
        sa.Column("params", sa.JSON(none_as_null=True), nullable=False),
        sa.Column("interactions", sa.JSON(none_as_null=True), nullable=False),
        sa.Column("checkpoint", sa.Integer(), nullable=False),
        sa.Column("based_on", sqlmodel.sql.sqltypes.AutoString(), nullable=True),
        sa.Column("policy_id", sqlmodel.sql.sqltypes.AutoString(), nullable=True),
        sa.Column("message", sqlmodel.sql.sqltypes.AutoString(), nullable=False),
        sa.Column("error", sa.JSON(none_as_null=True), nullable=True),
        sa.Column("version", sa.Integer(), nullable=False),
        sa.Column("created_at", sqlmodel.sql.sqltypes.AutoString(), nullable=False),
        sa.Column("updated_at", sqlmodel.sql.sqltypes.AutoString(), nullable=False),
        sa.CheckConstraint("kind IN ('performance', 'effort')", name=op.f("ck_run_kind")),
        sa.CheckConstraint(
            "state IN ('queued', 'training', 'waiting_for_expert', 'converged', 'stalled', 'infeasible', 'failed', 'cancelled')",
            name=op.f("ck_run_state"),
        ),
        sa.CheckConstraint("round >= 0 AND iteration >= 0 AND seed >= 0", name=op.f("ck_run_counts")),
        sa.ForeignKeyConstraint(["project_id"], ["project.id"], name=op.f("fk_run_project_id_project")),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_run")),
    )
    with op.batch_alter_table("run", schema=None) as batch_op:
        batch_op.create_index(batch_op.f("ix_run_project_id"), ["project_id"], unique=False)

    op.create_table(
        "tool",
        sa.Column("id", sqlmodel.sql.sqltypes.AutoString(), nullable=False),
        sa.Column("project_id", sqlmodel.sql.sqltypes.AutoString(), nullable=False),
        sa.Column("name", sqlmodel.sql.sqltypes.AutoString(), nullable=False),
        sa.Column("kind", sqlmodel.sql.sqltypes.AutoString(), nullable=False),
        sa.Column("state", sqlmodel.sql.sqltypes.AutoString(), nullable=False),
        sa.Column("questions", sa.JSON(none_as_null=True), nullable=True),
        sa.Column("units", sqlmodel.sql.sqltypes.AutoString(), nullable=True),
        sa.Column("up", sqlmodel.sql.sqltypes.AutoString(), nullable=True),
        sa.Column("file_name", sqlmodel.sql.sqltypes.AutoString(), nullable=True),
        sa.Column("source_sha", sqlmodel.sql.sqltypes.AutoString(), nullable=True),
        sa.Column("part_sha", sqlmodel.sql.sqltypes.AutoString(), nullable=True),
        sa.Column("split", sqlmodel.sql.sqltypes.AutoString(), nullable=True),
        sa.Column("report", sa.JSON(none_as_null=True), nullable=False),
        sa.Column("error", sa.JSON(none_as_null=True), nullable=True),
        sa.Column("version", sa.Integer(), nullable=False),
        sa.Column("created_at", sqlmodel.sql.sqltypes.AutoString(), nullable=False),
        sa.Column("deleted_at", sqlmodel.sql.sqltypes.AutoString(), nullable=True),
        sa.CheckConstraint("kind IN ('cad', 'table', 'sample')", name=op.f("ck_tool_kind")),
        sa.CheckConstraint("split IN ('train', 'test')", name=op.f("ck_tool_split")),
        sa.CheckConstraint("state IN ('asking', 'importing', 'ready', 'failed')", name=op.f("ck_tool_state")),
        sa.ForeignKeyConstraint(["part_sha"], ["artifact.sha"], name=op.f("fk_tool_part_sha_artifact")),
        sa.ForeignKeyConstraint(["project_id"], ["project.id"], name=op.f("fk_tool_project_id_project")),
        sa.ForeignKeyConstraint(["source_sha"], ["artifact.sha"], name=op.f("fk_tool_source_sha_artifact")),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_tool")),
    )
    with op.batch_alter_table("tool", schema=None) as batch_op:
        batch_op.create_index(batch_op.f("ix_tool_part_sha"), ["part_sha"], unique=False)
        batch_op.create_index(batch_op.f("ix_tool_project_id"), ["project_id"], unique=False)
        batch_op.create_index(batch_op.f("ix_tool_source_sha"), ["source_sha"], unique=False)

    op.create_table(
        "view_session",
        sa.Column("id", sqlmodel.sql.sqltypes.AutoString(), nullable=False),
        sa.Column("project_id", sqlmodel.sql.sqltypes.AutoString(), nullable=False),
        sa.Column("scene", sa.JSON(none_as_null=True), nullable=False),
        sa.Column("playback", sa.JSON(none_as_null=True), nullable=False),
        sa.Column("created_at", sqlmodel.sql.sqltypes.AutoString(), nullable=False),
        sa.ForeignKeyConstraint(["project_id"], ["project.id"], name=op.f("fk_view_session_project_id_project")),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_view_session")),
    )
    with op.batch_alter_table("view_session", schema=None) as batch_op:
        batch_op.create_index(batch_op.f("ix_view_session_project_id"), ["project_id"], unique=False)

    op.create_table(
        "metric",
        sa.Column("run_id", sqlmodel.sql.sqltypes.AutoString(), nullable=False),
        sa.Column("iteration", sa.Integer(), nullable=False),
        sa.Column("loss", sa.Float(), nullable=False),
        sa.Column("terms", sa.JSON(none_as_null=True), nullable=False),
        sa.Column("violations", sa.Integer(), nullable=False),
        sa.ForeignKeyConstraint(["run_id"], ["run.id"], name=op.f("fk_metric_run_id_run")),
        sa.PrimaryKeyConstraint("run_id", "iteration", name=op.f("pk_metric")),
    )
    op.create_table(
        "policy",
        sa.Column("id", sqlmodel.sql.sqltypes.AutoString(), nullable=False),
        sa.Column("project_id", sqlmodel.sql.sqltypes.AutoString(), nullable=False),
        sa.Column("run_id", sqlmodel.sql.sqltypes.AutoString(), nullable=False),
        sa.Column("name", sqlmodel.sql.sqltypes.AutoString(), nullable=False),
        sa.Column("feature_set", sqlmodel.sql.sqltypes.AutoString(), nullable=False),
        sa.Column("feature_version", sa.Integer(), nullable=False),
        sa.Column("interactions", sa.JSON(none_as_null=True), nullable=False),
        sa.Column("weights", sa.JSON(none_as_null=True), nullable=False),
        sa.Column("identifiable", sa.JSON(none_as_null=True), nullable=False),
        sa.Column("effort_weights", sa.JSON(none_as_null=True), nullable=True),
        sa.Column("converged", sa.Boolean(), nullable=False),
        sa.Column("learned_from", sa.JSON(none_as_null=True), nullable=False),
        sa.Column("created_at", sqlmodel.sql.sqltypes.AutoString(), nullable=False),
        sa.ForeignKeyConstraint(["project_id"], ["project.id"], name=op.f("fk_policy_project_id_project")),
        sa.ForeignKeyConstraint(["run_id"], ["run.id"], name=op.f("fk_policy_run_id_run")),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_policy")),
    )
    with op.batch_alter_table("policy", schema=None) as batch_op:
        batch_op.create_index(batch_op.f("ix_policy_project_id"), ["project_id"], unique=False)
        batch_op.create_index(batch_op.f("ix_policy_run_id"), ["run_id"], unique=False)

    op.create_table(
        "run_checkpoint",
        sa.Column("run_id", sqlmodel.sql.sqltypes.AutoString(), nullable=False),
        sa.Column("number", sa.Integer(), nullable=False),
        sa.Column("round", sa.Integer(), nullable=False),
        sa.Column("iteration", sa.Integer(), nullable=False),
        sa.Column("outcome", sqlmodel.sql.sqltypes.AutoString(), nullable=False),
        sa.Column("state", sa.JSON(none_as_null=True), nullable=False),
        sa.Column("weights", sa.JSON(none_as_null=True), nullable=False),
        sa.Column("identifiable", sa.JSON(none_as_null=True), nullable=False),
        sa.Column("created_at", sqlmodel.sql.sqltypes.AutoString(), nullable=False),
        sa.ForeignKeyConstraint(["run_id"], ["run.id"], name=op.f("fk_run_checkpoint_run_id_run")),
        sa.PrimaryKeyConstraint("run_id", "number", name=op.f("pk_run_checkpoint")),
    )
    op.create_table(
        "segmentation",
        sa.Column("id", sqlmodel.sql.sqltypes.AutoString(), nullable=False),
        sa.Column("tool_id", sqlmodel.sql.sqltypes.AutoString(), nullable=False),
        sa.Column("params", sa.JSON(none_as_null=True), nullable=False),
        sa.Column("tool_sha", sqlmodel.sql.sqltypes.AutoString(), nullable=False),
        sa.Column("region_count", sa.Integer(), nullable=False),
        sa.Column("feature_set", sqlmodel.sql.sqltypes.AutoString(), nullable=False),
        sa.Column("current", sa.Boolean(), nullable=False),
        sa.Column("created_at", sqlmodel.sql.sqltypes.AutoString(), nullable=False),
        sa.CheckConstraint("region_count >= 1", name=op.f("ck_segmentation_region_count")),
        sa.ForeignKeyConstraint(["tool_id"], ["tool.id"], name=op.f("fk_segmentation_tool_id_tool")),
        sa.ForeignKeyConstraint(["tool_sha"], ["artifact.sha"], name=op.f("fk_segmentation_tool_sha_artifact")),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_segmentation")),
    )
    with op.batch_alter_table("segmentation", schema=None) as batch_op:
        batch_op.create_index(batch_op.f("ix_segmentation_tool_id"), ["tool_id"], unique=False)
        batch_op.create_index(batch_op.f("ix_segmentation_tool_sha"), ["tool_sha"], unique=False)
        batch_op.create_index("uq_segmentation_current", ["tool_id"], unique=True, sqlite_where=sa.text("current"))

    op.create_table(
        "demonstration",
        sa.Column("id", sqlmodel.sql.sqltypes.AutoString(), nullable=False),
        sa.Column("project_id", sqlmodel.sql.sqltypes.AutoString(), nullable=False),
        sa.Column("tool_id", sqlmodel.sql.sqltypes.AutoString(), nullable=False),
        sa.Column("segmentation_id", sqlmodel.sql.sqltypes.AutoString(), nullable=False),
        sa.Column("name", sqlmodel.sql.sqltypes.AutoString(), nullable=False),
        sa.Column("sequence", sa.JSON(none_as_null=True), nullable=False),
        sa.Column("click_times", sa.JSON(none_as_null=True), nullable=True),
        sa.Column("author", sqlmodel.sql.sqltypes.AutoString(), nullable=True),
        sa.Column("source", sqlmodel.sql.sqltypes.AutoString(), nullable=False),
        sa.Column("superseded_by", sqlmodel.sql.sqltypes.AutoString(), nullable=True),
        sa.Column("version", sa.Integer(), nullable=False),
        sa.Column("created_at", sqlmodel.sql.sqltypes.AutoString(), nullable=False),
        sa.Column("deleted_at", sqlmodel.sql.sqltypes.AutoString(), nullable=True),
        sa.CheckConstraint("source IN ('recorded', 'table', 'scripted', 'rest')", name=op.f("ck_demonstration_source")),
        sa.ForeignKeyConstraint(["project_id"], ["project.id"], name=op.f("fk_demonstration_project_id_project")),
        sa.ForeignKeyConstraint(["segmentation_id"], ["segmentation.id"], name=op.f("fk_demonstration_segmentation_id_segmentation")),
        sa.ForeignKeyConstraint(["superseded_by"], ["demonstration.id"], name=op.f("fk_demonstration_superseded_by_demonstration")),
        sa.ForeignKeyConstraint(["tool_id"], ["tool.id"], name=op.f("fk_demonstration_tool_id_tool")),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_demonstration")),
    )
    with op.batch_alter_table("demonstration", schema=None) as batch_op:
        batch_op.create_index(batch_op.f("ix_demonstration_project_id"), ["project_id"], unique=False)
        batch_op.create_index(batch_op.f("ix_demonstration_segmentation_id"), ["segmentation_id"], unique=False)
        batch_op.create_index(batch_op.f("ix_demonstration_superseded_by"), ["superseded_by"], unique=False)
        batch_op.create_index(batch_op.f("ix_demonstration_tool_id"), ["tool_id"], unique=False)

    op.create_table(
        "draft",
        sa.Column("tool_id", sqlmodel.sql.sqltypes.AutoString(), nullable=False),
        sa.Column("segmentation_id", sqlmodel.sql.sqltypes.AutoString(), nullable=False),
        sa.Column("sequence", sa.JSON(none_as_null=True), nullable=False),
        sa.Column("click_times", sa.JSON(none_as_null=True), nullable=False),
        sa.Column("past", sa.JSON(none_as_null=True), nullable=False),
        sa.Column("future", sa.JSON(none_as_null=True), nullable=False),
        sa.Column("updated_at", sqlmodel.sql.sqltypes.AutoString(), nullable=False),
        sa.ForeignKeyConstraint(["segmentation_id"], ["segmentation.id"], name=op.f("fk_draft_segmentation_id_segmentation")),
        sa.ForeignKeyConstraint(["tool_id"], ["tool.id"], name=op.f("fk_draft_tool_id_tool")),
        sa.PrimaryKeyConstraint("tool_id", name=op.f("pk_draft")),
    )
    with op.batch_alter_table("draft", schema=None) as batch_op:
        batch_op.create_index(batch_op.f("ix_draft_segmentation_id"), ["segmentation_id"], unique=False)

    op.create_table(
        "plan",
        sa.Column("id", sqlmodel.sql.sqltypes.AutoString(), nullable=False),
        sa.Column("project_id", sqlmodel.sql.sqltypes.AutoString(), nullable=False),
        sa.Column("policy_id", sqlmodel.sql.sqltypes.AutoString(), nullable=False),
        sa.Column("tool_id", sqlmodel.sql.sqltypes.AutoString(), nullable=False),
        sa.Column("segmentation_id", sqlmodel.sql.sqltypes.AutoString(), nullable=False),
        sa.Column("sequence", sa.JSON(none_as_null=True), nullable=False),
        sa.Column("result", sa.JSON(none_as_null=True), nullable=False),
        sa.Column("created_at", sqlmodel.sql.sqltypes.AutoString(), nullable=False),
        sa.ForeignKeyConstraint(["policy_id"], ["policy.id"], name=op.f("fk_plan_policy_id_policy")),
        sa.ForeignKeyConstraint(["project_id"], ["project.id"], name=op.f("fk_plan_project_id_project")),
        sa.ForeignKeyConstraint(["segmentation_id"], ["segmentation.id"], name=op.f("fk_plan_segmentation_id_segmentation")),
        sa.ForeignKeyConstraint(["tool_id"], ["tool.id"], name=op.f("fk_plan_tool_id_tool")),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_plan")),
    )
    with op.batch_alter_table("plan", schema=None) as batch_op:
        batch_op.create_index(batch_op.f("ix_plan_policy_id"), ["policy_id"], unique=False)
        batch_op.create_index(batch_op.f("ix_plan_project_id"), ["project_id"], unique=False)
        batch_op.create_index(batch_op.f("ix_plan_segmentation_id"), ["segmentation_id"], unique=False)
        batch_op.create_index(batch_op.f("ix_plan_tool_id"), ["tool_id"], unique=False)

    op.create_table(
        "region_name",
        sa.Column("segmentation_id", sqlmodel.sql.sqltypes.AutoString(), nullable=False),
        sa.Column("region", sa.Integer(), nullable=False),
        sa.Column("name", sqlmodel.sql.sqltypes.AutoString(), nullable=False),
        sa.CheckConstraint("region >= 0", name=op.f("ck_region_name_region")),
        sa.ForeignKeyConstraint(["segmentation_id"], ["segmentation.id"], name=op.f("fk_region_name_segmentation_id_segmentation")),
        sa.PrimaryKeyConstraint("segmentation_id", "region", name=op.f("pk_region_name")),
    )
    op.create_table(
        "playback",
        sa.Column("id", sqlmodel.sql.sqltypes.AutoString(), nullable=False),
        sa.Column("project_id", sqlmodel.sql.sqltypes.AutoString(), nullable=False),
        sa.Column("plan_id", sqlmodel.sql.sqltypes.AutoString(), nullable=False),
        sa.Column("tool_id", sqlmodel.sql.sqltypes.AutoString(), nullable=False),
        sa.Column("state", sqlmodel.sql.sqltypes.AutoString(), nullable=False),
        sa.Column("parameters", sa.JSON(none_as_null=True), nullable=False),
        sa.Column("artifact_sha", sqlmodel.sql.sqltypes.AutoString(), nullable=True),
        sa.Column("summary", sa.JSON(none_as_null=True), nullable=True),
        sa.Column("error", sa.JSON(none_as_null=True), nullable=True),
        sa.Column("created_at", sqlmodel.sql.sqltypes.AutoString(), nullable=False),
        sa.CheckConstraint("state IN ('queued', 'running', 'ready', 'failed')", name=op.f("ck_playback_state")),
        sa.ForeignKeyConstraint(["artifact_sha"], ["artifact.sha"], name=op.f("fk_playback_artifact_sha_artifact")),
        sa.ForeignKeyConstraint(["plan_id"], ["plan.id"], name=op.f("fk_playback_plan_id_plan")),
        sa.ForeignKeyConstraint(["project_id"], ["project.id"], name=op.f("fk_playback_project_id_project")),
        sa.ForeignKeyConstraint(["tool_id"], ["tool.id"], name=op.f("fk_playback_tool_id_tool")),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_playback")),
    )
    with op.batch_alter_table("playback", schema=None) as batch_op:
        batch_op.create_index(batch_op.f("ix_playback_artifact_sha"), ["artifact_sha"], unique=False)
        batch_op.create_index(batch_op.f("ix_playback_plan_id"), ["plan_id"], unique=False)
        batch_op.create_index(batch_op.f("ix_playback_project_id"), ["project_id"], unique=False)
        batch_op.create_index(batch_op.f("ix_playback_tool_id"), ["tool_id"], unique=False)

    op.create_table(
        "query",
        sa.Column("id", sqlmodel.sql.sqltypes.AutoString(), nullable=False),
        sa.Column("run_id", sqlmodel.sql.sqltypes.AutoString(), nullable=False),
        sa.Column("project_id", sqlmodel.sql.sqltypes.AutoString(), nullable=False),
        sa.Column("tool_id", sqlmodel.sql.sqltypes.AutoString(), nullable=False),
        sa.Column("demonstration_id", sqlmodel.sql.sqltypes.AutoString(), nullable=False),
        sa.Column("kind", sqlmodel.sql.sqltypes.AutoString(), nullable=False),
        sa.Column("state", sqlmodel.sql.sqltypes.AutoString(), nullable=False),
        sa.Column("round", sa.Integer(), nullable=False),
        sa.Column("checkpoint", sa.Integer(), nullable=False),
        sa.Column("number", sa.Integer(), nullable=False),
        sa.Column("left", sa.JSON(none_as_null=True), nullable=False),
        sa.Column("right", sa.JSON(none_as_null=True), nullable=False),
        sa.Column("why", sqlmodel.sql.sqltypes.AutoString(), nullable=False),
        sa.Column("difference", sqlmodel.sql.sqltypes.AutoString(), nullable=False),
        sa.Column("differs", sa.JSON(none_as_null=True), nullable=False),
        sa.Column("fingerprint", sqlmodel.sql.sqltypes.AutoString(), nullable=False),
        sa.Column("created_at", sqlmodel.sql.sqltypes.AutoString(), nullable=False),
        sa.CheckConstraint("kind IN ('similarity', 'preference')", name=op.f("ck_query_kind")),
        sa.CheckConstraint("state IN ('open', 'answered', 'withdrawn')", name=op.f("ck_query_state")),
        sa.ForeignKeyConstraint(["demonstration_id"], ["demonstration.id"], name=op.f("fk_query_demonstration_id_demonstration")),
        sa.ForeignKeyConstraint(["project_id"], ["project.id"], name=op.f("fk_query_project_id_project")),
        sa.ForeignKeyConstraint(["run_id"], ["run.id"], name=op.f("fk_query_run_id_run")),
        sa.ForeignKeyConstraint(["tool_id"], ["tool.id"], name=op.f("fk_query_tool_id_tool")),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_query")),
    )
    with op.batch_alter_table("query", schema=None) as batch_op:
        batch_op.create_index(batch_op.f("ix_query_demonstration_id"), ["demonstration_id"], unique=False)
        batch_op.create_index(batch_op.f("ix_query_project_id"), ["project_id"], unique=False)
        batch_op.create_index(batch_op.f("ix_query_run_id"), ["run_id"], unique=False)
        batch_op.create_index(batch_op.f("ix_query_tool_id"), ["tool_id"], unique=False)
        batch_op.create_index("uq_query_fingerprint", ["run_id", "fingerprint"], unique=True)

    op.create_table(
        "run_demonstration",
        sa.Column("run_id", sqlmodel.sql.sqltypes.AutoString(), nullable=False),
        sa.Column("position", sa.Integer(), nullable=False),
        sa.Column("demonstration_id", sqlmodel.sql.sqltypes.AutoString(), nullable=False),
        sa.Column("tool_id", sqlmodel.sql.sqltypes.AutoString(), nullable=False),
        sa.ForeignKeyConstraint(
            ["demonstration_id"], ["demonstration.id"], name=op.f("fk_run_demonstration_demonstration_id_demonstration")
        ),
        sa.ForeignKeyConstraint(["run_id"], ["run.id"], name=op.f("fk_run_demonstration_run_id_run")),
        sa.ForeignKeyConstraint(["tool_id"], ["tool.id"], name=op.f("fk_run_demonstration_tool_id_tool")),
        sa.PrimaryKeyConstraint("run_id", "position", name=op.f("pk_run_demonstration")),
    )
    with op.batch_alter_table("run_demonstration", schema=None) as batch_op:
        batch_op.create_index(batch_op.f("ix_run_demonstration_demonstration_id"), ["demonstration_id"], unique=False)
        batch_op.create_index(batch_op.f("ix_run_demonstration_tool_id"), ["tool_id"], unique=False)

    op.create_table(
        "answer",
        sa.Column("id", sqlmodel.sql.sqltypes.AutoString(), nullable=False),
        sa.Column("query_id", sqlmodel.sql.sqltypes.AutoString(), nullable=False),
        sa.Column("value", sqlmodel.sql.sqltypes.AutoString(), nullable=False),
        sa.Column("client_key", sqlmodel.sql.sqltypes.AutoString(), nullable=True),
        sa.Column("superseded_by", sqlmodel.sql.sqltypes.AutoString(), nullable=True),
        sa.Column("created_at", sqlmodel.sql.sqltypes.AutoString(), nullable=False),
        sa.CheckConstraint(
            "value IN ('similar', 'not_similar', 'cant_tell', 'left', 'right', 'equal', 'undone')", name=op.f("ck_answer_value")
        ),
        sa.ForeignKeyConstraint(["query_id"], ["query.id"], name=op.f("fk_answer_query_id_query")),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_answer")),
    )
    with op.batch_alter_table("answer", schema=None) as batch_op:
        batch_op.create_index(batch_op.f("ix_answer_query_id"), ["query_id"], unique=False)
        batch_op.create_index("uq_answer_current", ["query_id"], unique=True, sqlite_where=sa.text("superseded_by IS NULL"))


def downgrade() -> None:
    with op.batch_alter_table("answer", schema=None) as batch_op:
        batch_op.drop_index("uq_answer_current", sqlite_where=sa.text("superseded_by IS NULL"))
        batch_op.drop_index(batch_op.f("ix_answer_query_id"))

    op.drop_table("answer")
    with op.batch_alter_table("run_demonstration", schema=None) as batch_op:
        batch_op.drop_index(batch_op.f("ix_run_demonstration_tool_id"))
        batch_op.drop_index(batch_op.f("ix_run_demonstration_demonstration_id"))

    op.drop_table("run_demonstration")
    with op.batch_alter_table("query", schema=None) as batch_op:
        batch_op.drop_index("uq_query_fingerprint")
        batch_op.drop_index(batch_op.f("ix_query_tool_id"))
        batch_op.drop_index(batch_op.f("ix_query_run_id"))
        batch_op.drop_index(batch_op.f("ix_query_project_id"))
        batch_op.drop_index(batch_op.f("ix_query_demonstration_id"))

    op.drop_table("query")
    with op.batch_alter_table("playback", schema=None) as batch_op:
        batch_op.drop_index(batch_op.f("ix_playback_tool_id"))
        batch_op.drop_index(batch_op.f("ix_playback_project_id"))
        batch_op.drop_index(batch_op.f("ix_playback_plan_id"))
        batch_op.drop_index(batch_op.f("ix_playback_artifact_sha"))

    op.drop_table("playback")
    op.drop_table("region_name")
    with op.batch_alter_table("plan", schema=None) as batch_op:
        batch_op.drop_index(batch_op.f("ix_plan_tool_id"))
        batch_op.drop_index(batch_op.f("ix_plan_segmentation_id"))
        batch_op.drop_index(batch_op.f("ix_plan_project_id"))
        batch_op.drop_index(batch_op.f("ix_plan_policy_id"))

    op.drop_table("plan")
    with op.batch_alter_table("draft", schema=None) as batch_op:
        batch_op.drop_index(batch_op.f("ix_draft_segmentation_id"))

    op.drop_table("draft")
    with op.batch_alter_table("demonstration", schema=None) as batch_op:
        batch_op.drop_index(batch_op.f("ix_demonstration_tool_id"))
        batch_op.drop_index(batch_op.f("ix_demonstration_superseded_by"))
        batch_op.drop_index(batch_op.f("ix_demonstration_segmentation_id"))
        batch_op.drop_index(batch_op.f("ix_demonstration_project_id"))

    op.drop_table("demonstration")
    with op.batch_alter_table("segmentation", schema=None) as batch_op:
        batch_op.drop_index("uq_segmentation_current", sqlite_where=sa.text("current"))
        batch_op.drop_index(batch_op.f("ix_segmentation_tool_sha"))
        batch_op.drop_index(batch_op.f("ix_segmentation_tool_id"))

    op.drop_table("segmentation")
    op.drop_table("run_checkpoint")
    with op.batch_alter_table("policy", schema=None) as batch_op:
        batch_op.drop_index(batch_op.f("ix_policy_run_id"))
        batch_op.drop_index(batch_op.f("ix_policy_project_id"))

    op.drop_table("policy")
    op.drop_table("metric")
    with op.batch_alter_table("view_session", schema=None) as batch_op:
        batch_op.drop_index(batch_op.f("ix_view_session_project_id"))

    op.drop_table("view_session")
    with op.batch_alter_table("tool", schema=None) as batch_op:
        batch_op.drop_index(batch_op.f("ix_tool_source_sha"))
        batch_op.drop_index(batch_op.f("ix_tool_project_id"))
        batch_op.drop_index(batch_op.f("ix_tool_part_sha"))

    op.drop_table("tool")
    with op.batch_alter_table("run", schema=None) as batch_op:
        batch_op.drop_index(batch_op.f("ix_run_project_id"))

    op.drop_table("run")
    with op.batch_alter_table("job", schema=None) as batch_op:
        batch_op.drop_index(batch_op.f("ix_job_subject_id"))
        batch_op.drop_index("ix_job_queue")
        batch_op.drop_index(batch_op.f("ix_job_project_id"))

    op.drop_table("job")
    op.drop_table("project")
    op.drop_table("idempotency")
    with op.batch_alter_table("event", schema=None) as batch_op:
        batch_op.drop_index(batch_op.f("ix_event_project_id"))
        batch_op.drop_index(batch_op.f("ix_event_created_at"))

    op.drop_table("event")
    op.drop_table("artifact")
