"""The paper's evaluation as the table that is printed; `evaluation` does the work."""

from app.learning.evaluation import HIT_GAP, HIT_SIZE, StudyReport, ToolResult, run_study
from app.sequencing.features import FEATURE_SETS, interaction_label

__all__ = ["StudyReport", "ToolResult", "format_study", "run_study"]


def format_study(report: StudyReport) -> str:
    """The study in plain text, ready to print."""
    covered, result = report.covered, report.performance
    features = FEATURE_SETS[report.policy.features]
    suspected = ", ".join(interaction_label(i, features) for i in report.coverage_interactions)
    learned = ", ".join(interaction_label(i, features) for i in report.policy.interactions) or "none"
    trained = [t for t in report.tools if t.trained]
    unseen = [t for t in report.tools if not t.trained]
    lines = [
        f"Study on the authors' {report.kind} tools, seed {report.seed}, feature set {features.name} version {features.version}, "
        f"learned interactions: {learned}.",
        f"Train on {_numbers(trained)}; test on {_numbers(unseen)}.",
        "",
        f"Coverage rho       {covered.rho:.3f} ({covered.captured} of {covered.possible} cells; {suspected})",
        f"Outcome            {result.outcome}: {result.message}",
        f"Iterations         {result.state.iteration} in {result.state.round} round{'s' if result.state.round > 1 else ''}",
        f"Queries            {report.queries} similarity ({report.called_similar} called similar), {report.effort_queries} preference",
        f"Effort             {report.effort.outcome}: {report.effort.message}",
        f"Weights            {_moved(report)}",
        f"Training violations {report.violations} of {len(trained)} (recorded order not the cheapest at {HIT_GAP:g})",
        f"Hits               train {_hits(trained)}, test {_hits(unseen)}  (lowest cost class, of at most {HIT_SIZE} orders "
        "or equivalent orders only)",
        f"Mean Kendall tau   train {_tau(trained)}, test {_tau(unseen)}",
        "",
        "tool  regions  split  hit  class size   cost gap   tau",
        *(_row(t) for t in report.tools),
        "",
        "weight of each feature (a feature marked * can't be identified from these training tools)",
        *_weights(report),
    ]
    kept = [t for t in report.unasked if t.trained]
    new = [t for t in report.unasked if not t.trained]
    how = {"certified": "exact weights, certified", "exceptions": "exceptions allowed for"}[report.unasked_kind]
    lines += [
        "",
        f"Our own learner, no answers ({how}): hits train {_hits(kept)}, test {_hits(new)}; "
        f"mean Kendall tau train {_tau(kept)}, test {_tau(new)}",
        "tool  regions  split  hit  class size   cost gap   tau",
        *(_row(t) for t in report.unasked),
    ]
    if report.left_out:
        lines += ["", f"Left out, without a valid recorded order: {', '.join(map(str, report.left_out))}."]
    if report.faults:
        told = ", ".join(f"tool {number}: {count}" for number, count in report.faults)
        lines += ["", f"Faults named while reading the tables: {told}."]
    return "\n".join(lines)


def _moved(report: StudyReport) -> str:
    """How far learning went beyond its prior."""
    state = report.performance.state
    known = [w for w, live in zip(state.weights, state.identifiable, strict=True) if live]
    above = sum(w > report.floor * (1 + 1e-6) for w in known)
    return f"{above} of {len(known)} identifiable weights left their floor; at the floor each counts alike per spread"


def _row(t: ToolResult) -> str:
    split, hit = "train" if t.trained else "test", "yes" if t.hit else "no"
    return f"{t.number:4d}  {t.regions:7d}  {split:5s}  {hit:3s}  {t.class_size:10,d}  {t.gap:9.2e}  {t.tau:5.2f}"


def _weights(report: StudyReport) -> list[str]:
    columns = FEATURE_SETS[report.policy.features].columns
    labels = [c.label for c in columns] + [interaction_label(i, FEATURE_SETS[report.policy.features]) for i in report.policy.interactions]
    marks = ["" if known else " *" for known in report.policy.identifiable]
    rows = zip(labels, report.policy.weights, marks, strict=True)
    return [f"  {label:38s} {weight:12.6g}{mark}" for label, weight, mark in rows]


def _numbers(tools: list[ToolResult]) -> str:
    return ", ".join(str(t.number) for t in tools) or "none"


def _hits(tools: list[ToolResult]) -> str:
    return f"{sum(t.hit for t in tools)}/{len(tools)}"


def _tau(tools: list[ToolResult]) -> str:
    return f"{sum(t.tau for t in tools) / len(tools):.2f}" if tools else "-"
