"""What `apprentice study` does beyond one evaluation: compare learners, take Eq. 7 apart, coverage of subsets, effort before and after."""

import json
import time
from collections.abc import Callable, Iterator
from dataclasses import asdict, is_dataclass
from pathlib import Path
from typing import Any

import numpy as np

from app.benches.plots import QUANTITIES, Bars, Curve, Plot, as_svg, bars_as_svg
from app.benches.report import ablation_table, comparison_tables, coverage_table, effort_table, save_report
from app.learning.ablation import Ablation, ablate
from app.learning.comparing import (
    LEARNERS,
    Case,
    Line,
    Score,
    format_comparison,
    learners,
    leave_one_out,
    made_up_cases,
    score,
    summed,
    synthetic_case,
    title_of,
)
from app.learning.coverage_study import SubsetCoverage, format_coverage, study_coverage, subset_words
from app.learning.effort_study import SideResult, study_effort
from app.learning.evaluation import TRAINED_ON, Kind, read_tables, recorded_in
from app.learning.performance_state import LearningDemonstration
from app.sequencing.problem import problem_for

Say = Callable[[str], None]


def demonstrations(kind: Kind, folder: Path) -> dict[int, LearningDemonstration]:
    """The authors' tools of a kind with their recorded orders, without interactions."""
    tables = read_tables(kind, folder)
    return {i: LearningDemonstration(problem_for(t.tool.graph, ()), recorded_in(i, t)) for i, t in tables.items()}


def compare(data: Path, out: Path | None, say: Say, experts: int = 30, seed: int = 0) -> None:
    """Every learner on synthetic tools, real tools one left out at a time, and made-up experts."""
    scores: list[Score] = []
    synthetic = demonstrations("synthetic", data)
    trained = TRAINED_ON["synthetic"]
    list(_all_learners([synthetic_case(synthetic, trained)], seed))  # compiles everything, so that times are times of learning
    scores += _all_learners([synthetic_case(synthetic, trained)], seed)
    say(format_comparison(summed(scores)) + "\n")
    real = list(_all_learners(leave_one_out(demonstrations("real", data)), seed))
    say(format_comparison(summed(real)) + "\n")
    scores += real
    problems = {i: d.problem for i, d in synthetic.items()}
    invented = list(_all_learners(list(made_up_cases(problems, trained, experts, seed)), seed))
    say(format_comparison(summed(invented)))
    scores += invented
    lines = summed(scores)
    _save(out, "compare.json", {"seed": seed, "lines": lines, "scores": scores})
    save_report(out, "compare", "Learners side by side", data, comparison_tables(lines), {"experts": experts})
    for kind in dict.fromkeys(line.kind for line in lines):
        found = [line for line in lines if line.kind == kind]
        _write(out, f"compare_{kind.replace(' ', '_')}.svg", bars_as_svg(comparison_bars(found)))


def comparison_bars(lines: list[Line]) -> Bars:
    """Tools predicted without having been shown, per learner; lines of one kind."""
    shares = {"hit": np.array([100 * line.test_success for line in lines])}
    words = {"hit": tuple(f"{line.test_hits} of {line.test}" for line in lines)}
    names = tuple(line.learner for line in lines)
    note = "Each learner saw the same recorded orders on other tools; only those that ask got answers"
    return Bars(title_of(lines[0]), "Unseen tools on which the expert's order is chosen (%)", names, shares, words, note, 100)


def _all_learners(cases: list[Case], seed: int) -> Iterator[Score]:
    for name in LEARNERS:
        for case in cases:
            yield score(name, learners(case, seed)[name], case, seed, time.process_time)


def ablation(data: Path, out: Path | None, say: Say, seeds: int = 20, updates: int = 60) -> None:
    """Fig. 4 on the synthetic training tools."""
    shown = demonstrations("synthetic", data)
    found = ablate([shown[i] for i in TRAINED_ON["synthetic"]], seeds, updates)
    say(f"Eq. 7 without each of its terms, {found.seeds} seeds, {found.updates} updates: mean at the end and its 95 % interval")
    say(f"{'':12s}" + "".join(f"{name:>26s}" for name in QUANTITIES))
    for variant, bands in found.bands.items():
        ends = [f"{b.mean[-1]:.3f} [{b.low[-1]:.3f}, {b.high[-1]:.3f}]" for b in bands.values()]
        say(f"{variant:12s}" + "".join(f"{end:>26s}" for end in ends))
    _save(out, "ablation.json", asdict(found))
    save_report(out, "ablation", "Eq. 7 term by term", data, [ablation_table(found)], {"seeds": seeds})
    for quantity in QUANTITIES:
        _write(out, f"ablation_{quantity}.svg", as_svg(ablation_plot(found, quantity)))


def ablation_plot(found: Ablation, quantity: str) -> Plot:
    """One of Fig. 4's three plots."""
    title, label = QUANTITIES[quantity]
    first = 1 if quantity == "shift" else 0  # nothing has moved before the first update
    x = np.arange(first, found.updates + 1.0)
    curves = tuple(  # none of the quantities can be negative, whatever the interval around its mean says
        Curve(name, x, b[quantity].mean[first:], np.maximum(b[quantity].low[first:], 0.0), b[quantity].high[first:])
        for name, b in found.bands.items()
    )
    note = f"Mean of {found.seeds} runs and its 95 % confidence interval, {found.tools} training tools"
    return Plot(title, "Update of the weights", label, curves, note)


def coverage(data: Path, out: Path | None, say: Say) -> None:
    """Table I."""
    results = {}
    for kind in ("synthetic", "real"):
        results[kind] = study_coverage(demonstrations(kind, data))
        say(format_coverage(results[kind], kind) + "\n")
        _write(out, f"coverage_{kind}.svg", bars_as_svg(coverage_bars(results[kind], kind)))
    _save(out, "coverage.json", results)
    save_report(out, "coverage", "Coverage of four sets of demonstrations", data, [coverage_table(r, kind) for kind, r in results.items()])


def coverage_bars(rows: list[SubsetCoverage], kind: str) -> Bars:
    """Table I: what was published beside our two figures."""
    found = {
        "published": [r.published for r in rows],
        "strict rule": [r.strict for r in rows],
        "shown at all": [r.plain for r in rows],
    }
    return Bars(
        f"Coverage of subsets of the authors' {kind} tools",
        "Coverage rho",
        tuple(f"tools {subset_words(r.tools)}" for r in rows),
        {name: np.array(values) for name, values in found.items()},
        {name: tuple(f"{v:.2f}" for v in values) for name, values in found.items()},
        "The published numbers rest on levels that are not published, so they are shown beside ours only",
        most=1.0,
    )


def effort(data: Path, out: Path | None, say: Say) -> None:
    """Fig. 5 on the synthetic split."""
    shown = demonstrations("synthetic", data)
    trained, unseen = [[d for i, d in shown.items() if (i in TRAINED_ON["synthetic"]) is part] for part in (True, False)]
    found = study_effort(trained, unseen, np.ones(len(trained[0].problem.columns)))
    say("Preferred side, learned on the training tools: tools whose chosen order has the least effort, before -> after learning")
    say("(tools on which the preference makes no difference are left out)")
    say("preference           answers   training tools   unseen tools")
    for r in found:
        seen, new = (f"{t.before} -> {t.after} of {t.tools}" for t in (r.trained, r.unseen))
        say(f"{r.preference:19s}  {r.answers:7d}   {seen:>14s}   {new:>12s}")
    _save(out, "effort.json", found)
    save_report(out, "effort", "Before and after a preferred side is learned", data, [effort_table(found)])
    for part, words in (("trained", "training tools"), ("unseen", "unseen tools")):
        _write(out, f"effort_{part}.svg", bars_as_svg(effort_bars(found, part, words)))


def effort_bars(found: list[SideResult], part: str, words: str) -> Bars:
    """Fig. 5: on how many tools the chosen order has the least effort, before and after learning."""
    tallies, asked = [getattr(r, part) for r in found], [r.answers for r in found]
    told = {f"{at} learning": [getattr(t, at) for t in tallies] for at in ("before", "after")}
    return Bars(
        f"The chosen order has the least effort: {words}",
        "Tools on which the preference makes a difference (%)",
        tuple(r.preference for r in found),
        {at: np.array([100 * c / max(t.tools, 1) for c, t in zip(counts, tallies, strict=True)]) for at, counts in told.items()},
        {at: tuple(f"{c} of {t.tools}" for c, t in zip(counts, tallies, strict=True)) for at, counts in told.items()},
        f"One expert per preference, found in {min(asked)} to {max(asked)} answers about the training tools",
        most=100,
    )


def _save(out: Path | None, name: str, value: Any) -> None:
    _write(out, name, json.dumps(value, indent=2, default=_plain) + "\n")


def _write(out: Path | None, name: str, text: str) -> None:
    if out is not None:
        out.mkdir(parents=True, exist_ok=True)
        (out / name).write_text(text, encoding="utf-8")


def _plain(value: Any) -> Any:
    if is_dataclass(value) and not isinstance(value, type):
        return asdict(value)
    return value.tolist() if isinstance(value, (np.ndarray, np.generic)) else str(value)
