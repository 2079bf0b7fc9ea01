"""Coverage of a project's demonstrations (Eq. 5-6), and which interactions the expert suspects."""

from typing import Any

from sqlmodel import Session

from app.learning.coverage import RULE, Cell, CoverageReport, InteractionTable
from app.learning.levels import Levels
from app.sequencing.features import FeatureSet, interaction_label
from app.storage import emit
from app.storage.tables import Project, Segmentation, ToolRow
from app.workflow.context import Context
from app.workflow.feature_choice import project_features
from app.workflow.lookup import present, standing
from app.workflow.project_rows import checked_interactions, project_json, touch
from app.workflow.reports import report_of

Json = dict[str, Any]


def get_coverage(ctx: Context, project_id: str) -> Json:
    """rho, the tables behind it, and what to demonstrate next."""

    def query(session: Session) -> Json:
        project = present(session, Project, project_id)
        tools, report = report_of(ctx.values, session, project, ())
        return coverage_json(session, project, tools, report)

    return ctx.store.read(query)


def set_interactions(ctx: Context, project_id: str, interactions: list[dict[str, str]]) -> Json:
    """Say which interactions the expert suspects.

    Raises:
        InvalidInput: One is named twice, or pairs a factor with itself.
        UnknownFeature: A factor that the project's features don't have.
    """

    def change(session: Session) -> None:
        project = present(session, Project, project_id)
        features = project_features(session, project_id)
        project.interactions = checked_interactions(features, interactions)
        touch(session, project)
        emit(session, "coverage.changed", project_id)

    ctx.store.write(change)
    return ctx.store.read(lambda session: project_json(ctx.values, session, present(session, Project, project_id)))


NOTHING: Json = {
    "rho": None,
    "occurrence": None,
    "captured": 0,
    "shown": 0,
    "possible": 0,
    "demonstrations": 0,
    "steps": 0,
    "rule": RULE,
    "thresholds": [],
    "tables": [],
    "requests": [],
}


def coverage_json(session: Session, project: Project, tools: list[ToolRow], report: CoverageReport | None) -> Json:
    """The report as REST shows it."""
    if report is None:
        return NOTHING
    shown = [d for d in standing(session, project.id) if d.tool_id in {t.id for t in tools}]
    cut = session.get(Segmentation, shown[0].segmentation_id)
    assert cut is not None
    features = project_features(session, project.id, cut.feature_set)
    return {
        "rho": report.rho,
        "occurrence": report.occurrence,
        "captured": report.captured,
        "shown": report.shown,
        "possible": report.possible,
        "demonstrations": len(shown),
        "steps": report.steps,
        "rule": report.rule,
        "thresholds": _thresholds(report.thresholds),
        "tables": [_table(features, tools, table) for table in report.tables],
        "requests": [
            {
                "text": r.text,
                "tool_id": tools[r.tool_index].id,
                "tool_name": tools[r.tool_index].name,
                "regions": [int(a) for a in r.regions],
                "gain": float(r.gain),
                "expected": float(r.expected),
            }
            for r in report.requests
        ],
    }


def _thresholds(levels: Levels) -> list[Json]:
    rows = zip(levels.keys, levels.low, levels.high, levels.rules, strict=True)
    return [{"feature": key, "low": low, "high": high, "rule": rule} for key, low, high, rule in rows]


def _table(features: FeatureSet, tools: list[ToolRow], table: InteractionTable) -> Json:
    interaction = table.interaction
    return {
        "first": interaction.first,
        "second": interaction.second,
        "label": interaction_label(interaction, features),
        "row_title": table.row_title,
        "column_title": table.column_title,
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
