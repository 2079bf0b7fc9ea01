"""One step of a learner, away from the database: what it needs, what it gives, and how it is computed."""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from app.jobs.worker import Report
from app.learning.certified_run import Memory, certified_step, start_certified
from app.learning.certified_state import CertifiedParameters, CertifiedState
from app.learning.effort import EffortParameters, EffortState, effort_step, start_effort
from app.learning.exception_run import ExceptionMemory, ExceptionParameters, ExceptionState, exception_step
from app.learning.generalising import Generalised, exactness, exceptions_predict_better, learn_generalising, on_features, why_untested
from app.learning.performance import (
    LearningDemonstration,
    PerformanceParameters,
    PerformanceState,
    performance_step,
    start_performance,
)
from app.learning.performance_conflict import Contradiction
from app.learning.performance_state import Metric
from app.learning.qp import Array
from app.learning.selecting import Selection, select_interactions
from app.learning.sureness import sureness
from app.sequencing.features import FEATURE_SETS, Interaction
from app.sequencing.problem import SequencingProblem
from app.workflow.values import Kept

Json = dict[str, Any]
Parameters = PerformanceParameters | CertifiedParameters | EffortParameters | ExceptionParameters
MetricRow = tuple[int, float, dict[str, float], int]

LIKELIHOOD = "likelihood"  # kind of the step that settles a contradiction
CONTRADICT = "Your orders contradict each other, so exceptions are allowed for. Each order left out in turn,"
AGREE = (
    "One set of weights explains every order exactly, but it would have predicted only {} of {} of them from the others. "
    "With exceptions allowed for,"
)
CHUNK = 25  # iterations per job: a few seconds at most between two checkpoints
_problems = Kept(48)  # of a worker process: their tables are costly to build
_memories = Kept(4)  # of a worker process: what earlier steps of a certified run found; losing it costs only time
_doubts = Kept(4)  # the same of runs about one tool


@dataclass(frozen=True)
class Step:
    """Everything a step needs."""

    run_id: str
    kind: str
    keys: tuple[tuple[Any, ...], ...]  # of the problems, to recognise them
    demonstrations: tuple[LearningDemonstration, ...]
    parameters: Parameters
    seed: int
    state: Json | None  # None: start
    answers: dict[str, str]
    base: tuple[float, ...]  # effort: the performance weights
    tools: tuple[SequencingProblem, ...] = ()  # certified: tools of interest
    tool_keys: tuple[tuple[Any, ...], ...] = ()
    gone: frozenset[int] = frozenset()  # of them, those that were deleted or cut anew since


@dataclass(frozen=True)
class Asked:
    """A question of any kind."""

    demonstration: int | None  # index of the run's demonstrations
    left: tuple[int, ...]
    right: tuple[int, ...]
    why: str
    differs: tuple[int, ...]
    fingerprint: str
    tool: int | None = None  # certified: index of the run's tools of interest


@dataclass(frozen=True)
class Outcome:
    """What a step gave."""

    state: Json
    outcome: str
    iteration: int
    metrics: tuple[MetricRow, ...]
    questions: tuple[Asked, ...]
    weights: tuple[float, ...]
    identifiable: tuple[bool, ...]
    message: str
    contradiction: Contradiction | None = None
    report: Json | None = None  # certified: with indices for tools and demonstrations
    features: str | None = None  # likelihood: name of the feature set it chose
    interactions: tuple[Interaction, ...] | None = None  # first step of a certified run: those that count from here on


def compute(step: Step, report: Report) -> Outcome:
    """One step of the learner; pure."""
    report(0.05, "Comparing orders")
    known = [LearningDemonstration(_known(key, d.problem), d.sequence) for key, d in zip(step.keys, step.demonstrations, strict=True)]
    tools = [_known(key, tool) for key, tool in zip(step.tool_keys, step.tools, strict=True)]
    if step.kind == LIKELIHOOD:
        return _likelihood(learn_generalising(known), known, tools, CONTRADICT)
    if isinstance(step.parameters, CertifiedParameters) and step.state is None:
        return _begin(step, step.parameters, known, tools, report)
    if isinstance(step.parameters, CertifiedParameters):
        return _certified(step, step.parameters, known, tools)
    if isinstance(step.parameters, EffortParameters):
        return _effort(step, step.parameters, known)
    if isinstance(step.parameters, ExceptionParameters):
        return _exception(step, step.parameters, known, tools[0], report)
    return _performance(step, step.parameters, known)


def _known(key: tuple[Any, ...], problem: SequencingProblem) -> SequencingProblem:
    return _problems.get(key, lambda: problem)


def _begin(
    step: Step, parameters: CertifiedParameters, known: list[LearningDemonstration], tools: list[SequencingProblem], report: Report
) -> Outcome:
    """The first step of a certified run: which suspected interactions count, whether exceptions are allowed for, what is open."""
    chosen = select_interactions(
        known, known[0].problem.interactions, step.seed, lambda share, words: report(round(0.05 + 0.6 * share, 2), words)
    )
    demonstrations = [replace(d, problem=_counting(d.problem, chosen)) for d in known]
    exceptions = exceptions_predict_better(demonstrations, step.seed)
    if exceptions is not None:
        return _likelihood(exceptions.generalised, known, tools, AGREE.format(exceptions.certified_hits, len(known)))
    out = _certified(step, parameters, demonstrations, [_counting(t, chosen) for t in tools])
    out = replace(out, message=f"{out.message} {why_untested(demonstrations)}".rstrip())
    return replace(out, interactions=chosen.kept, report={**(out.report or {}), "interactions": chosen.to_json(known[0])})


def _counting(problem: SequencingProblem, chosen: Selection) -> SequencingProblem:
    """The same tool with the interactions that count; the very same problem where they all do."""
    return problem if problem.interactions == chosen.kept else replace(problem, interactions=chosen.kept)


def _certified(
    step: Step, parameters: CertifiedParameters, demonstrations: list[LearningDemonstration], tools: list[SequencingProblem]
) -> Outcome:
    state = CertifiedState.from_json(step.state) if step.state else start_certified(demonstrations, tools, parameters, step.seed)
    memory: Memory = _memories.get((step.run_id, step.seed, parameters, len(demonstrations)), Memory.empty)
    result = certified_step(demonstrations, tools, parameters, state, step.answers, memory, step.gone)
    return Outcome(
        state=result.state.to_json(),
        outcome=result.outcome,
        iteration=result.state.steps,
        metrics=tuple(_row(m) for m in result.metrics),
        questions=tuple(Asked(None, q.left, q.right, q.why, q.differs, q.fingerprint, q.tool) for q in result.questions),
        weights=_floats(result.weights),
        identifiable=result.report.identifiable,
        message=result.message,
        contradiction=result.contradiction,
        report=result.report.to_json(),
    )


def _likelihood(found: Generalised, demonstrations: list[LearningDemonstration], tools: list[SequencingProblem], why: str) -> Outcome:
    """The policy that allows for exceptions, how well it predicts each demonstration left out in turn, and how sure it is of the rest."""
    chosen, policy, count = found.chosen, found.policy, len(demonstrations)
    own = demonstrations[0].problem.features
    features = own if policy.features == own.name else FEATURE_SETS[policy.features]
    sure = sureness(found, [on_features(t, features) for t in tools], CertifiedParameters().tolerance)
    counted = exactness([d.problem.n for d in demonstrations], found.approximate)
    report = {
        "shares": list(sure.shares),
        "intervals": [list(x) for x in sure.intervals],
        "tools": [vars(c) for c in sure.tools],
        "expected_wrong": sum(1 - c.probability for c in sure.tools),
        "kind": LIKELIHOOD,
        "held_out_hits": chosen.hits,
        "of": count,
        "tau": chosen.tau,
        "features": chosen.features,
        "penalty": chosen.penalty,
        "exactness": counted,
    }
    words = f"{why} {chosen.hits} of {count} are predicted from the others (mean agreement {chosen.tau:.2f}). {counted}".rstrip()
    weights, decided = _floats(policy.weights), tuple(bool(x) for x in policy.identifiable)
    return Outcome({}, "compromise", 0, (), (), weights, decided, words, None, report, policy.features)


def _performance(step: Step, parameters: PerformanceParameters, demonstrations: list[LearningDemonstration]) -> Outcome:
    state = PerformanceState.from_json(step.state) if step.state else start_performance(demonstrations, parameters, step.seed)
    result = performance_step(demonstrations, parameters, state, step.answers, CHUNK)
    return Outcome(
        state=result.state.to_json(),
        outcome=result.outcome,
        iteration=result.state.iteration,
        metrics=tuple(_row(m) for m in result.metrics),
        questions=tuple(
            Asked(q.demonstration, demonstrations[q.demonstration].sequence, q.candidate, q.why, q.differs, q.fingerprint)
            for q in result.questions
        ),
        weights=_floats(result.weights),
        identifiable=tuple(bool(x) for x in result.state.identifiable),
        message=result.message,
        contradiction=result.contradiction,
    )


def _effort(step: Step, parameters: EffortParameters, demonstrations: list[LearningDemonstration]) -> Outcome:
    if step.state:
        state = EffortState.from_json(step.state)
    else:
        state = start_effort(demonstrations, np.array(step.base), parameters, step.seed)
    result = effort_step(demonstrations, parameters, state, step.answers)
    asked = tuple(Asked(q.demonstration, q.left, q.right, q.why, q.differs, q.fingerprint) for q in result.questions)
    weights = _floats(result.effort_weights)
    return Outcome(result.state.to_json(), result.outcome, 0, (), asked, weights, tuple(True for _ in weights), result.message)


def _exception(
    step: Step, parameters: ExceptionParameters, demonstrations: list[LearningDemonstration], tool: SequencingProblem, report: Report
) -> Outcome:
    report(0.1, "Looking for orders you may want")
    state = ExceptionState.from_json(step.state) if step.state else ExceptionState(step.seed)
    memory: ExceptionMemory = _doubts.get((step.run_id, step.seed), ExceptionMemory)
    result = exception_step(demonstrations, tool, parameters, state, step.answers, memory)
    asked = tuple(Asked(None, q.left, q.right, q.why, q.differs, q.fingerprint, 0) for q in result.questions)
    return Outcome(result.state.to_json(), "questions" if asked else "converged", 0, (), asked, (), (), result.message)


def _row(m: Metric) -> MetricRow:
    return m.iteration, float(m.loss), {k: float(v) for k, v in m.terms.items()}, int(m.violations)


def _floats(values: Array) -> tuple[float, ...]:
    return tuple(float(x) for x in values)
