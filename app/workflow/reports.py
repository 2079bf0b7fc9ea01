"""Coverage reports of a project, kept in memory by what they depend on."""

from sqlmodel import Session

from app.learning.coverage import CoverageReport, coverage
from app.learning.levels import LevelRules, factor_groups
from app.sequencing.features import FeatureSet
from app.storage.tables import Project, ToolRow
from app.workflow.authors import expert_key
from app.workflow.feature_choice import project_features
from app.workflow.lookup import current_segmentation, standing, tools_of
from app.workflow.values import Values, interactions_from

Pick = tuple[str, str, tuple[int, ...]]  # tool id, key of the expert, sequence


def rho(values: Values, session: Session, project: Project) -> float | None:
    """Captured share of the possible situations, None without a demonstration."""
    report = report_of(values, session, project, ())[1]
    return None if report is None else report.rho


def report_of(values: Values, session: Session, project: Project, extra: tuple[Pick, ...]) -> tuple[list[ToolRow], CoverageReport | None]:
    """The report on the standing demonstrations, with `extra` ones in place of the same expert's of the same tool."""
    picks = {(d.tool_id, expert_key(d.author)): tuple(d.sequence) for d in standing(session, project.id)}
    picks.update({(tool, expert): sequence for tool, expert, sequence in extra})
    shown_tools = {tool for tool, _ in picks}
    cuts = {t.id: cut for t in tools_of(session, project.id) if (cut := current_segmentation(session, t.id))}
    known = [t for t in tools_of(session, project.id) if t.id in cuts]
    first = next((t for t in known if t.id in shown_tools), None)
    if first is None:
        return [], None
    tools = [t for t in known if cuts[t.id].feature_set == cuts[first.id].feature_set]
    interactions = interactions_from(project.interactions)
    counted = project_features(session, project.id, cuts[first.id].feature_set)
    shown = tuple((i, picks[key]) for i, t in enumerate(tools) for key in sorted(picks) if key[0] == t.id)
    rules = level_rules(project, counted)
    key = (tuple(cuts[t.id].id for t in tools), shown, interactions, counted.name, rules)

    def make() -> CoverageReport:
        problems = [values.problem(session, cuts[t.id], interactions, counted) for t in tools]
        return coverage(problems, list(shown), interactions, rules)

    return tools, values.reports.get(key, make)


def level_rules(project: Project, features: FeatureSet) -> LevelRules:
    """How the project's levels are found; what was chosen for a feature that doesn't count now waits until it does."""
    known, levels = factor_groups(features).keys(), project.levels
    chosen = tuple((key, rule) for key, rule in sorted(levels.get("chosen", {}).items()) if key in known)
    expert = tuple((key, float(low), float(high)) for key, (low, high) in sorted(levels.get("expert", {}).items()) if key in known)
    return LevelRules(levels.get("default", "quantile"), chosen, expert)
