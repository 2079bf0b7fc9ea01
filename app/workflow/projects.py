"""Projects: listing, making, renaming, putting away."""

from typing import Any

from sqlmodel import Session, col, select

from app.learning.process_templates import BUILT_IN
from app.storage.identity import now
from app.storage.tables import Project
from app.workflow.context import Context
from app.workflow.lookup import check_version, present, refuse_while_training
from app.workflow.process import start_from
from app.workflow.project_rows import add_project, checked_name, project_json, touch
from app.workflow.sample import create_sample

Json = dict[str, Any]


def list_projects(ctx: Context) -> list[Json]:
    """All projects, oldest first."""

    def query(session: Session) -> list[Json]:
        rows = session.exec(select(Project).where(col(Project.deleted_at).is_(None)).order_by(col(Project.id)))
        return [project_json(ctx.values, session, row) for row in rows.all()]

    return ctx.store.read(query)


def create_project(ctx: Context, name: str, process: str = "") -> Json:
    """An empty project; a process that a built-in template is for starts from it, others from that of layup."""

    def change(session: Session) -> str:
        row = add_project(session, name, process)
        template = next((t for t in BUILT_IN if t.name == process), None)
        if template is not None:
            start_from(session, row, template.key)
        return row.id

    project_id = ctx.store.write(change)
    return get_project(ctx, project_id)


def create_sample_project(ctx: Context) -> Json:
    """The project that ships: parametric moulds, most of them demonstrated by a scripted expert, one left to record."""
    row = ctx.store.write(lambda session: add_project(session, "Layup of sample moulds", "Composite layup", sample=True).id)
    create_sample(ctx, row)
    return get_project(ctx, row)


def get_project(ctx: Context, project_id: str) -> Json:
    """One project."""
    return ctx.store.read(lambda session: project_json(ctx.values, session, present(session, Project, project_id)))


def update_project(ctx: Context, project_id: str, changes: Json, version: int | None = None) -> Json:
    """Change name or process."""

    def change(session: Session) -> None:
        row = present(session, Project, project_id)
        check_version(row, version)
        row.name = checked_name(changes.get("name", row.name))
        row.process = changes.get("process", row.process)
        touch(session, row)

    ctx.store.write(change)
    return get_project(ctx, project_id)


def delete_project(ctx: Context, project_id: str, version: int | None = None) -> None:
    """Put the project away; refused while something trains in it."""

    def change(session: Session) -> None:
        row = present(session, Project, project_id)
        check_version(row, version)
        refuse_while_training(session, row)
        row.deleted_at = now()
        touch(session, row)

    ctx.store.write(change)
