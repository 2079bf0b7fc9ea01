"""The job that takes a run one step further: a chunk of iterations, or the next questions.

Each step is a pure function of checkpoint and answers, and is stored in one transaction with its metrics, questions, the
run's new state and the next job. So the same seed and answers give the same weights bit for bit, whenever it is interrupted.
"""

from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from sqlmodel import Session, col, select

from app.jobs.dispatcher import Handler
from app.jobs.rows import add_job
from app.jobs.worker import Report
from app.learning.differences import describe_difference
from app.learning.effort import EffortParameters, EffortState, effort_step, start_effort
from app.learning.performance import (
    LearningDemonstration,
    PerformanceParameters,
    PerformanceState,
    performance_step,
    start_performance,
)
from app.learning.performance_conflict import Contradiction, contradiction_words
from app.learning.qp import Array
from app.sequencing.problem import SequencingProblem
from app.storage import emit
from app.storage.tables import Demonstration, JobRow, Metric, PolicyRow, Query, Run, RunCheckpoint, RunDemonstration, Segmentation, ToolRow
from app.workflow.lookup import found
from app.workflow.run_rows import TRAINING_JOB, checkpoint_of, current_answer, go, parameters_for, write_policy
from app.workflow.values import Kept, Values, interactions_from

Json = dict[str, Any]

KIND = TRAINING_JOB
CHUNK = 25  # iterations per job: a few seconds at most between two checkpoints
_problems = Kept(24)  # of a worker process: their tables are costly to build


@dataclass(frozen=True)
class Step:
    """Everything a step needs."""

    kind: str
    keys: tuple[tuple[Any, ...], ...]  # of the problems, to recognise them
    demonstrations: tuple[LearningDemonstration, ...]
    parameters: PerformanceParameters | EffortParameters
    seed: int
    state: Json | None  # None: start
    answers: dict[str, str]
    base: tuple[float, ...]  # effort: the performance weights


@dataclass(frozen=True)
class Asked:
    """A question of either kind."""

    demonstration: int
    left: tuple[int, ...]
    right: tuple[int, ...]
    why: str
    differs: tuple[int, ...]
    fingerprint: str


@dataclass(frozen=True)
class Outcome:
    """What a step gave."""

    state: Json
    outcome: str
    iteration: int
    metrics: tuple[tuple[int, float, dict[str, float], int], ...]
    questions: tuple[Asked, ...]
    weights: tuple[float, ...]
    identifiable: tuple[bool, ...]
    message: str
    contradiction: Contradiction | None = None


def handler(values: Values) -> Handler:
    """How training jobs are done."""
    return Handler(partial(prepare, values), compute, partial(finish, values), fail, begin)


def begin(session: Session, job: JobRow) -> None:
    """The run trains from here on."""
    row = session.get(Run, job.subject_id)
    if row is not None and row.state == "queued":
        go(session, row, "training")


def prepare(values: Values, session: Session, job: JobRow) -> Step | None:
    """The step that comes next; None when the run is over."""
    row = session.get(Run, job.subject_id)
    if row is None or row.state not in ("queued", "training"):
        return None
    interactions = interactions_from(row.interactions)
    demonstrations, keys = [], []
    for shown in demonstrations_of(session, row.id):
        cut = found(session, Segmentation, shown.segmentation_id, "segmentation")
        demonstrations.append(LearningDemonstration(values.problem(session, cut, interactions), tuple(shown.sequence)))
        keys.append((cut.id, interactions))
    checkpoint = checkpoint_of(session, row)
    base = session.get(PolicyRow, row.based_on) if row.based_on else None
    return Step(
        kind=row.kind,
        keys=tuple(keys),
        demonstrations=tuple(demonstrations),
        parameters=parameters_for(row.kind, row.params),
        seed=row.seed,
        state=checkpoint.state if checkpoint else None,
        answers=_answers(session, row.id),
        base=tuple(base.weights) if base else (),
    )


def compute(step: Step, report: Report) -> Outcome:
    """One step of the learner; pure."""
    report(0.05, "Comparing orders")
    known = [LearningDemonstration(_known(key, d.problem), d.sequence) for key, d in zip(step.keys, step.demonstrations, strict=True)]
    return _effort(step, known) if step.kind == "effort" else _performance(step, known)


def finish(values: Values, session: Session, job: JobRow, out: Outcome) -> None:
    """Checkpoint, metrics, questions, state and next job, all or nothing."""
    row = session.get(Run, job.subject_id)
    if row is None or row.state not in ("queued", "training"):
        return
    for iteration, loss, terms, violations in out.metrics:
        session.merge(Metric(run_id=row.id, iteration=iteration, loss=loss, terms=terms, violations=violations))
    row.iteration = out.iteration
    row.checkpoint += 1
    if out.questions:
        _ask(values, session, row, out.questions)
    session.add(_checkpoint(row, out))
    if out.outcome == "training":
        go(session, row, "training", out.message)
        add_job(session, KIND, row.project_id, row.id, job.title)
    elif out.outcome == "questions":
        go(session, row, "waiting_for_expert", _words(session, row, out))
    else:
        _close(session, row, out)


def fail(session: Session, job: JobRow, error: dict[str, str]) -> None:
    """The run stops; it can be resumed from its last checkpoint."""
    row = session.get(Run, job.subject_id)
    if row is not None and row.state in ("queued", "training"):
        row.error = error
        go(session, row, "failed", error["detail"])


def demonstrations_of(session: Session, run_id: str) -> list[Demonstration]:
    """What a run trains on, in its order."""
    wanted = select(Demonstration).join(RunDemonstration, col(RunDemonstration.demonstration_id) == col(Demonstration.id))
    return list(session.exec(wanted.where(RunDemonstration.run_id == run_id).order_by(col(RunDemonstration.position))))


def _known(key: tuple[Any, ...], problem: SequencingProblem) -> SequencingProblem:
    return _problems.get(key, lambda: problem)


def _performance(step: Step, demonstrations: list[LearningDemonstration]) -> Outcome:
    assert isinstance(step.parameters, PerformanceParameters)
    state = PerformanceState.from_json(step.state) if step.state else start_performance(demonstrations, step.parameters, step.seed)
    result = performance_step(demonstrations, step.parameters, state, step.answers, CHUNK)
    return Outcome(
        state=result.state.to_json(),
        outcome=result.outcome,
        iteration=result.state.iteration,
        metrics=tuple((m.iteration, float(m.loss), {k: float(v) for k, v in m.terms.items()}, int(m.violations)) for m in result.metrics),
        questions=tuple(
            Asked(q.demonstration, demonstrations[q.demonstration].sequence, q.candidate, q.why, q.differs, q.fingerprint)
            for q in result.questions
        ),
        weights=_floats(result.weights),
        identifiable=tuple(bool(x) for x in result.state.identifiable),
        message=result.message,
        contradiction=result.contradiction,
    )


def _effort(step: Step, demonstrations: list[LearningDemonstration]) -> Outcome:
    assert isinstance(step.parameters, EffortParameters)
    if step.state:
        state = EffortState.from_json(step.state)
    else:
        state = start_effort(demonstrations, np.array(step.base), step.parameters, step.seed)
    result = effort_step(demonstrations, step.parameters, state, step.answers)
    asked = tuple(Asked(q.demonstration, q.left, q.right, q.why, q.differs, q.fingerprint) for q in result.questions)
    weights = _floats(result.effort_weights)
    return Outcome(result.state.to_json(), result.outcome, 0, (), asked, weights, tuple(True for _ in weights), result.message)


def _floats(values: Array) -> tuple[float, ...]:
    return tuple(float(x) for x in values)


def _answers(session: Session, run_id: str) -> dict[str, str]:
    queries = session.exec(select(Query).where(Query.run_id == run_id, Query.state == "answered").order_by(col(Query.id)))
    return {query.fingerprint: answer.value for query in queries.all() if (answer := current_answer(session, query.id))}


def _checkpoint(row: Run, out: Outcome) -> RunCheckpoint:
    return RunCheckpoint(
        run_id=row.id,
        number=row.checkpoint,
        round=row.round,
        iteration=out.iteration,
        outcome=out.outcome,
        state=out.state,
        weights=list(out.weights),
        identifiable=list(out.identifiable),
    )


def _ask(values: Values, session: Session, row: Run, questions: tuple[Asked, ...]) -> None:
    """Store the questions of a round; one that was withdrawn before is asked again."""
    shown = demonstrations_of(session, row.id)
    known = {q.fingerprint: q for q in session.exec(select(Query).where(Query.run_id == row.id)).all()}
    again = all(asked.fingerprint in known and known[asked.fingerprint].round == row.round for asked in questions)
    if not again:  # a run that was stopped and goes on asks the rest of its round
        row.round += 1
    for number, asked in enumerate(questions, start=1):
        demonstration = shown[asked.demonstration]
        tool = values.tool(session, found(session, Segmentation, demonstration.segmentation_id, "segmentation"))
        names, descriptions = [r.name for r in tool.regions], [r.description for r in tool.regions]
        query = known.get(asked.fingerprint)
        if query is None:
            query = Query(
                run_id=row.id,
                project_id=row.project_id,
                tool_id=demonstration.tool_id,
                demonstration_id=demonstration.id,
                kind="similarity" if row.kind == "performance" else "preference",
                round=row.round,
                checkpoint=row.checkpoint,
                number=number,
                left=list(asked.left),
                right=list(asked.right),
                why=asked.why,
                difference=describe_difference(names, descriptions, asked.left, asked.right),
                differs=list(asked.differs),
                fingerprint=asked.fingerprint,
            )
        if not again:
            query.round, query.number = row.round, number
        query.state, query.checkpoint = "open", row.checkpoint
        session.add(query)
        session.flush()
        emit(session, "query.changed", row.project_id, query_id=query.id, run_id=row.id)


def _close(session: Session, row: Run, out: Outcome) -> None:
    """The end of a run, with a policy if it converged."""
    if out.outcome == "converged":
        write_policy(session, row, list(out.weights), list(out.identifiable), converged=True)
    elif out.outcome == "infeasible":
        shown, found_odd = demonstrations_of(session, row.id), out.contradiction.odd if out.contradiction else ()
        row.error = {
            "error": "ContradictoryAnswers",
            "detail": _words(session, row, out),
            "tools": [shown[i].tool_id for i in found_odd],
        }
    go(session, row, out.outcome, _words(session, row, out))


def _words(session: Session, row: Run, out: Outcome) -> str:
    """What a step says, with the names of the tools where it says which demonstrations contradict each other."""
    if out.contradiction is None or out.outcome not in ("questions", "infeasible"):
        return out.message
    names = [found(session, ToolRow, shown.tool_id, "tool").name for shown in demonstrations_of(session, row.id)]
    words = contradiction_words(out.contradiction, names)
    return words if out.outcome == "infeasible" else f"Is the other order just as good? {words}"
