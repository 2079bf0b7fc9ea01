"""Coverage of a project's demonstrations (Eq. 5-6), and which interactions the expert suspects."""

from typing import Any

from sqlmodel import Session

from app.errors import InvalidInput, UnknownFeature
from app.learning.coverage import RULE, Cell, CoverageReport, InteractionTable
from app.learning.levels import factor_groups
from app.sequencing.features import FeatureSet, factor_label, interaction_label
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


def set_levels(ctx: Context, project_id: str, feature: str, rule: str | None, thresholds: tuple[float, float] | None = None) -> Json:
    """Say how small, middle and large values of one feature are told apart.

    Args:
        ctx: Where.
        project_id: Which.
        feature: A factor of the project's features.
        rule: "quantile", "range", "expert" (then with thresholds), or None for the project's usual rule.
        thresholds: At most the first is small, above the second is large.

    Raises:
        UnknownFeature: A feature that doesn't count in the project.
        InvalidInput: Thresholds are missing, or the lower one is above the upper one.
    """

    def change(session: Session) -> None:
        project = present(session, Project, project_id)
        known = factor_groups(project_features(session, project_id))
        if feature not in known:
            raise UnknownFeature(f"There is no feature {feature!r} to set levels of. Known are: {', '.join(sorted(known))}.")
        chosen = {k: v for k, v in project.levels.get("chosen", {}).items() if k != feature}
        expert = {k: v for k, v in project.levels.get("expert", {}).items() if k != feature}
        if rule == "expert":
            expert[feature] = checked_thresholds(thresholds)
        elif rule is not None:
            chosen[feature] = rule
        project.levels = {**project.levels, "chosen": chosen, "expert": expert}
        touch(session, project)
        emit(session, "coverage.changed", project_id)

    ctx.store.write(change)
    return get_coverage(ctx, project_id)


def checked_thresholds(thresholds: tuple[float, float] | None) -> list[float]:
    if thresholds is None:
        raise InvalidInput("Thresholds of your own need two numbers: up to which value is small, and above which large.")
    low, high = thresholds
    if low > high:
        raise InvalidInput(f"Small would end at {low:g}, above where large begins, {high:g}. Give the smaller one first.")
    return [low, high]


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
        "thresholds": _thresholds(features, report),
        "tables": [_table(features, tools, table) for table in report.tables],
        "requests": [
            {
                "text": r.text,
                "tool_id": tools[r.tool_index].id,
                "tool_name": tools[r.tool_index].name,
                "regions": [int(a) for a in r.regions],
                "gain": float(r.gain),
                "expected": float(r.expected),
                "useful": r.useful,
            }
            for r in report.requests
        ],
    }


def _thresholds(features: FeatureSet, report: CoverageReport) -> list[Json]:
    """Those of suspected features first."""
    levels, suspected = report.thresholds, {key for t in report.tables for key in (t.interaction.first, t.interaction.second)}
    rows = zip(levels.keys, levels.low, levels.high, levels.rules, report.spreads, strict=True)
    found = [
        {
            "feature": key,
            "label": factor_label(key, features),
            "low": low,
            "high": high,
            "rule": rule,
            "suspected": key in suspected,
            "least": spread.least,
            "most": spread.most,
            "counts": list(spread.counts),
        }
        for key, low, high, rule, spread in rows
    ]
    return sorted(found, key=lambda row: not row["suspected"])


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
        "need": cell.need,
    }
