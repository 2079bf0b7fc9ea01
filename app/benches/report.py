"""`report.json` of a study: its tables in words, the command that makes them, and when it ran; the studies page shows it."""

import json
import shlex
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from datetime import UTC, datetime
from pathlib import Path

from app.benches.plots import QUANTITIES
from app.learning.ablation import Ablation
from app.learning.comparing import MEANS, Line, by_kind, not_best, title_of
from app.learning.coverage_study import WHY, SubsetCoverage, subset_words
from app.learning.effort_study import SideResult
from app.learning.evaluation import StudyReport

REPORT = "report.json"
Cell = str | int | float | None
WHAT = "Training and unseen: share of the tools on which the expert's order is chosen; tau: its agreement with the order chosen there."


@dataclass(frozen=True)
class Table:
    """A table as people read it."""

    title: str
    columns: tuple[str, ...]
    rows: tuple[tuple[Cell, ...], ...]
    note: str = ""


def save_report(
    out: Path | None, study: str, title: str, data: Path, tables: Sequence[Table], options: dict[str, int] | None = None
) -> None:
    """Write the report into `out`, if a folder was named."""
    if out is None:
        return
    words = ["./dev", "study", study, "--data", str(data), "--out", str(out)]
    words += [word for name, value in (options or {}).items() for word in (f"--{name}", str(value))]
    report = {
        "study": study,
        "title": title,
        "command": shlex.join(words),
        "made_at": datetime.now(UTC).isoformat(timespec="seconds"),
        "tables": [asdict(table) for table in tables],
    }
    out.mkdir(parents=True, exist_ok=True)
    (out / REPORT).write_text(json.dumps(report, indent=2) + "\n", encoding="utf-8")


def comparison_tables(lines: Sequence[Line]) -> list[Table]:
    """One table per kind of tools."""
    columns = ("Learner", "Training", "Unseen", "Hits", "Extra cost", "Tau", "Answers", "CPU (s)")
    tables = []
    for found in by_kind(lines):
        rows = tuple(
            (
                *(line.learner, f"{line.train_success:.0%}", f"{line.test_success:.0%}", f"{line.test_hits}/{line.test}"),
                "-" if line.regret is None else f"{line.regret:.2%}",
                *(f"{line.tau:.2f}", f"{line.answers:.1f}", f"{line.cpu_s:.2f}"),
            )
            for line in found
        )
        tables.append(Table(title_of(found[0]), columns, rows, " ".join([WHAT, MEANS, *not_best(found)])))
    return tables


def ablation_table(found: Ablation) -> Table:
    """What each variant of Eq. 7 ends with."""
    columns = ("Variant", "Spread of costs", "Shift of the cheapest", "Orders not the cheapest")  # as QUANTITIES has them
    ends = [(name, *(_interval(b[q].mean[-1], b[q].low[-1], b[q].high[-1]) for q in QUANTITIES)) for name, b in found.bands.items()]
    note = f"{found.seeds} runs of {found.updates} updates each: mean at the end and its 95 % interval."
    return Table("Eq. 7 without each of its terms (Fig. 4)", columns, tuple(ends), note)


def _interval(mean: float, low: float, high: float) -> str:
    return f"{mean:.3f} [{low:.3f}, {high:.3f}]"


def coverage_table(rows: Sequence[SubsetCoverage], kind: str) -> Table:
    """Table I beside ours."""
    columns = ("Tools", "Published", "Strict rule", "Shown at all", "Captured", "Shown", "Possible")
    body = tuple(
        (subset_words(r.tools), *(f"{share:.2f}" for share in (r.published, r.strict, r.plain)), r.captured, r.shown, r.possible)
        for r in rows
    )
    return Table(f"Coverage of subsets of the authors' {kind} tools (Table I)", columns, body, WHY)


def effort_table(found: Sequence[SideResult]) -> Table:
    """Fig. 5 in figures."""
    columns = ("Preference", "Answers", "Training tools: before", "after", "of", "Unseen tools: before", "after", "of")
    rows = tuple((r.preference, r.answers, *(x for t in (r.trained, r.unseen) for x in (t.before, t.after, t.tools))) for r in found)
    return Table(
        "Tools whose chosen order has the least effort (Fig. 5)", columns, rows, "Tools on which it makes no difference are left out."
    )


def evaluation_tables(report: StudyReport) -> list[Table]:
    """The paper's evaluation: totals, then tool by tool."""
    parts = [[t for t in report.tools if t.trained is part] for part in (True, False)]
    hits = [f"{sum(t.hit for t in part)}/{len(part)}" for part in parts]
    totals = Table(
        "In short",
        ("Coverage", "Iterations", "Similarity questions", "Preference questions", "Training tools hit", "Unseen tools hit"),
        ((round(report.covered.rho, 3), report.performance.state.iteration, report.queries, report.effort_queries, *hits),),
        report.performance.message,
    )
    columns = ("Tool", "Regions", "Part", "Hit", "Equally cheap orders", "Extra cost", "Agreement (tau)")
    rows = tuple(
        (
            t.number,
            t.regions,
            "training" if t.trained else "unseen",
            "yes" if t.hit else "no",
            t.class_size,
            f"{t.gap:.1e}",
            round(t.tau, 2),
        )
        for t in report.tools
    )
    return [totals, Table("Tool by tool", columns, rows)]
