"""Coverage of a project's demonstrations (Eq. 5-6), and which interactions the expert suspects."""

from typing import Any

from sqlmodel import Session

from app.errors import InvalidInput, UnknownFeature
from app.learning.coverage import RULE, Cell, CoverageReport, InteractionTable, coverage
from app.sequencing.features import interaction_label
from app.storage import emit
from app.storage.tables import Project, Segmentation, ToolRow
from app.workflow.context import Context
from app.workflow.lookup import current_segmentation, present, standing, tools_of
from app.workflow.values import interactions_from

Json = dict[str, Any]
Pick = tuple[str, tuple[int, ...]]  # tool id, sequence


def get_coverage(ctx: Context, project_id: str) -> Json:
    """rho, the tables behind it, and what to demonstrate next."""

    def query(session: Session) -> Json:
        project = present(session, Project, project_id)
        tools, report = report_of(ctx, session, project, ())
        return coverage_json(ctx, session, project, tools, report)

    return ctx.store.read(query)


def rho(ctx: Context, session: Session, project: Project) -> float | None:
    """Captured share of the possible situations, None without a demonstration."""
    report = report_of(ctx, session, project, ())[1]
    return None if report is None else report.rho


def report_of(ctx: Context, session: Session, project: Project, extra: tuple[Pick, ...]) -> tuple[list[ToolRow], CoverageReport | None]:
    """The report on the standing demonstrations, with `extra` ones in place of those of their tools."""
    picks: dict[str, tuple[int, ...]] = {d.tool_id: tuple(d.sequence) for d in standing(session, project.id)}
    picks.update(extra)
    cuts = {t.id: cut for t in tools_of(session, project.id) if (cut := current_segmentation(session, t.id))}
    known = [t for t in tools_of(session, project.id) if t.id in cuts]
    first = next((t for t in known if t.id in picks), None)
    if first is None:
        return [], None
    tools = [t for t in known if cuts[t.id].feature_set == cuts[first.id].feature_set]
    interactions = interactions_from(project.interactions)
    shown = tuple((i, picks[t.id]) for i, t in enumerate(tools) if t.id in picks)
    key = (tuple(cuts[t.id].id for t in tools), shown, interactions)

    def make() -> CoverageReport:
        problems = [ctx.values.problem(session, cuts[t.id], interactions) for t in tools]
        return coverage(problems, list(shown), interactions)

    return tools, ctx.values.reports.get(key, make)


def set_interactions(ctx: Context, project_id: str, interactions: list[dict[str, str]]) -> Json:
    """Say which interactions the expert suspects.

    Raises:
        InvalidInput: One is named twice, or pairs a factor with itself.
        UnknownFeature: A factor that the project's features don't have.
    """
    from app.workflow.projects import get_project, project_features, touch

    def change(session: Session) -> None:
        project = present(session, Project, project_id)
        features = project_features(session, project_id)
        seen: set[frozenset[str]] = set()
        for pair in interactions:
            for key in (pair["first"], pair["second"]):
                if key not in features.factors:
                    raise UnknownFeature(f"There is no feature {key!r}. Known are: {', '.join(sorted(features.factors))}.")
            both = frozenset((pair["first"], pair["second"]))
            if len(both) < 2:
                raise InvalidInput(f"An interaction needs two different features, not {pair['first']} twice.")
            if both in seen:
                raise InvalidInput(f"The interaction of {pair['first']} and {pair['second']} is named twice.")
            seen.add(both)
        project.interactions = [{"first": pair["first"], "second": pair["second"]} for pair in interactions]
        touch(session, project)
        emit(session, "coverage.changed", project_id)

    ctx.store.write(change)
    return get_project(ctx, project_id)


NOTHING: Json = {"rho": None, "captured": 0, "possible": 0, "demonstrations": 0, "steps": 0, "rule": RULE, "tables": [], "requests": []}


def coverage_json(ctx: Context, session: Session, project: Project, tools: list[ToolRow], report: CoverageReport | None) -> Json:
    """The report as REST shows it."""
    if report is None:
        return NOTHING
    shown = [d for d in standing(session, project.id) if d.tool_id in {t.id for t in tools}]
    cut = session.get(Segmentation, shown[0].segmentation_id)
    assert cut is not None
    return {
        "rho": report.rho,
        "captured": report.captured,
        "possible": report.possible,
        "demonstrations": len(shown),
        "steps": report.steps,
        "rule": report.rule,
        "tables": [_table(ctx, session, cut, tools, table) for table in report.tables],
        "requests": [
            {
                "text": r.text,
                "tool_id": tools[r.tool_index].id,
                "tool_name": tools[r.tool_index].name,
                "regions": [int(a) for a in r.regions],
                "gain": float(r.gain),
            }
            for r in report.requests
        ],
    }


def _table(ctx: Context, session: Session, cut: Segmentation, tools: list[ToolRow], table: InteractionTable) -> Json:
    interaction = table.interaction
    features = ctx.values.problem(session, cut, (interaction,)).features
    return {
        "first": interaction.first,
        "second": interaction.second,
        "label": interaction_label(interaction, features),
        "row_words": list(table.row_words),
        "column_words": list(table.column_words),
        "cells": [[_cell(tools, cell) for cell in row] for row in table.cells],
    }


def _cell(tools: list[ToolRow], cell: Cell) -> Json:
    return {
        "state": cell.state,
        "count": int(cell.count),
        "p_value": None if cell.p_value is None else float(cell.p_value),
        "tools": [{"tool_id": tools[k].id, "name": tools[k].name, "regions": [int(a) for a in regions]} for k, regions in cell.tools],
        "text": cell.text,
        "request": cell.request,
    }
