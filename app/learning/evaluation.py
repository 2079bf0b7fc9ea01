"""The paper's evaluation on the authors' region tables, without a person: a scripted expert answers the questions.

Paper:
    Synthetic split as published (train 1, 2, 3, 6, 8, 9; test 4, 5, 7, 10). Which real tools were held out is not: we train on 1-6
        and test on the rest.
    The scripted expert of the synthetic tools weighs all ten features alike, which the paper's project page states; of the real tools'
        expert nothing is known, so only orders with the recorded order's feature sum count as just as good. Both prefer the recorded order
        to every equivalent one.
    A hit is defined in `hits`.
"""

import re
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np

from app.errors import InvalidInput, NotFound
from app.geometry.region_table import RegionTable, read_region_table
from app.learning.coverage import CoverageReport, coverage
from app.learning.effort import EffortParameters, EffortStepResult
from app.learning.expert import ScriptedExpert
from app.learning.generalising import learn_unasked, on_features
from app.learning.hits import HIT_GAP, HIT_SIZE, judge
from app.learning.performance import start_performance
from app.learning.performance_state import LearningDemonstration, PerformanceParameters, StepResult
from app.learning.policy import Policy
from app.learning.prediction import predict
from app.learning.scripted import answer_preferences, answer_similarity
from app.sequencing.features import FEATURE_SETS, Interaction
from app.sequencing.problem import SequencingProblem, problem_for

Kind = Literal["synthetic", "real"]
__all__ = ["HIT_GAP", "HIT_SIZE", "StudyReport", "ToolResult", "run_study"]

TRAINED_ON = {"synthetic": (1, 2, 3, 6, 8, 9), "real": (1, 2, 3, 4, 5, 6)}
INTERACTIONS: dict[str, tuple[Interaction, ...]] = {"synthetic": (), "real": ()}


@dataclass(frozen=True)
class ToolResult:
    """How well the learned policy explains one tool's recorded order."""

    number: int
    regions: int
    trained: bool
    hit: bool
    class_size: int  # orders in the lowest cost class
    gap: float  # relative excess of the recorded order's cost
    tau: float  # Kendall tau of the predicted order to the recorded one


@dataclass(frozen=True)
class StudyReport:
    """What one run of the evaluation found."""

    kind: Kind
    seed: int
    covered: CoverageReport
    coverage_interactions: tuple[Interaction, ...]
    performance: StepResult
    queries: int
    called_similar: int
    violations: int  # training tools whose recorded order is not the cheapest at 1e-7
    effort: EffortStepResult
    effort_queries: int
    policy: Policy
    tools: tuple[ToolResult, ...]
    unasked: tuple[ToolResult, ...]  # the same tools under our own learner, which got no answers
    unasked_kind: Literal["certified", "exceptions"]  # what it chose: exact weights, or exceptions allowed for
    left_out: tuple[int, ...]  # tables without a valid expert's sequence
    faults: tuple[tuple[int, int], ...]  # (tool, number of faults its table has)
    floor: float  # lower bound of a weight, on scaled features


def run_study(
    kind: Kind,
    folder: Path,
    seed: int = 0,
    parameters: PerformanceParameters | None = None,
    report: Callable[[str], None] = lambda text: None,
) -> StudyReport:
    """Train on the training tools, answer as the scripted expert, evaluate on all.

    Args:
        kind: Which tables.
        folder: Holds `synthetic/` and `real/`, or the tables themselves.
        seed: Of the run.
        parameters: Hyperparameters, default ones if None.
        report: Called with a sentence now and then.

    Raises:
        NotFound: No tables there.
        MalformedTable: A table can't be read.
    """
    parameters = parameters or PerformanceParameters()
    everything = read_tables(kind, folder)
    tables = {number: table for number, table in everything.items() if table.expert is not None}
    problems = {number: problem_for(table.tool.graph, INTERACTIONS[kind]) for number, table in tables.items()}
    recorded = {number: recorded_in(number, table) for number, table in tables.items()}
    trained = [number for number in tables if number in TRAINED_ON[kind]]
    demonstrations = [LearningDemonstration(problems[i], recorded[i]) for i in trained]
    suspected = (Interaction("height", "curvature"), Interaction("orientation", "curvature"))
    index = {number: k for k, number in enumerate(tables)}
    covered = coverage(list(problems.values()), [(index[i], recorded[i]) for i in trained], suspected)
    expert = _expert(kind, demonstrations[0])
    begin = start_performance(demonstrations, parameters, seed)
    result, answers = answer_similarity(demonstrations, expert, parameters, begin, report=report)
    effort, effort_answers = answer_preferences(demonstrations, result.weights, EffortParameters(), _recorded_first, seed)
    features = demonstrations[0].problem.features
    policy = Policy(result.weights, features.name, features.version, INTERACTIONS[kind], effort.effort_weights, result.state.identifiable)
    tools = tuple(_evaluate(i, problems[i], recorded[i], i in trained, policy) for i in tables)
    own = learn_unasked(demonstrations, seed)
    known = {**FEATURE_SETS, features.name: features}
    under = problems if own.certificate else {i: on_features(p, known[own.policy.features]) for i, p in problems.items()}
    return StudyReport(
        kind=kind,
        seed=seed,
        covered=covered,
        coverage_interactions=suspected,
        performance=result,
        queries=len(answers),
        called_similar=sum(value == "similar" for value in answers.values()),
        violations=sum(t.trained and t.gap > HIT_GAP for t in tools),
        effort=effort,
        effort_queries=len(effort_answers),
        policy=policy,
        tools=tools,
        unasked=tuple(_evaluate(i, under[i], recorded[i], i in trained, own.policy) for i in tables),
        unasked_kind="certified" if own.certificate else "exceptions",
        left_out=tuple(i for i in everything if i not in tables),
        faults=tuple((i, len(table.faults)) for i, table in everything.items() if table.faults),
        floor=parameters.floor,
    )


def read_tables(kind: Kind, folder: Path) -> dict[int, RegionTable]:
    """The authors' tables of a kind by number.

    Raises:
        NotFound: None of the training tools is there.
        MalformedTable: A table can't be read.
    """
    place = folder / kind if (folder / kind).is_dir() else folder
    found = {int(m[1]): path for path in place.glob("*.csv") if (m := re.fullmatch(r"Mold_(\d+)_Data\.csv", path.name))}
    if not found:
        raise NotFound(f"There are no region tables in {place}. Expected files named Mold_1_Data.csv, Mold_2_Data.csv and so on.")
    tables = {i: read_region_table(found[i].read_text(encoding="utf-8"), kind, found[i].name) for i in sorted(found)}
    if not set(tables) & set(TRAINED_ON[kind]):
        raise NotFound(f"None of the training tools {', '.join(map(str, TRAINED_ON[kind]))} is in {place}.")
    return tables


def recorded_in(number: int, table: RegionTable) -> tuple[int, ...]:
    """The expert's order in a table."""
    if table.expert is None:
        raise InvalidInput(f"The table of tool {number} has no expert's sequence; the study needs one for every tool.")
    return table.expert


def _expert(kind: Kind, demonstration: LearningDemonstration) -> ScriptedExpert:
    if kind == "real":
        return ScriptedExpert(None, None)
    n = len(demonstration.problem.features.columns)
    return ScriptedExpert(np.r_[np.ones(n), np.zeros(len(demonstration.problem.columns) - n)], None)


def _recorded_first(problem: SequencingProblem, left: tuple[int, ...], right: tuple[int, ...]) -> str:
    """The recorded order, always shown on the left, is preferred."""
    del problem, left, right
    return "left"


def _evaluate(number: int, problem: SequencingProblem, recorded: tuple[int, ...], trained: bool, policy: Policy) -> ToolResult:
    found = judge(problem, policy.weights, recorded, predict(problem, policy).sequence)
    return ToolResult(number, problem.n, trained, found.hit, found.class_size, found.gap, found.tau)
