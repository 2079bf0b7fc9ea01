"""The job that takes a run one step further: a chunk of iterations, or the next questions.

Each step is a pure function of checkpoint and answers, and is stored in one transaction with its metrics, questions, the
run's new state and the next job. So the same seed and answers give the same weights bit for bit, whenever it is interrupted.
"""

from dataclasses import replace
from functools import partial
from typing import Any

from sqlmodel import Session, col, select

from app.jobs.dispatcher import Handler
from app.jobs.rows import add_job
from app.learning.differences import PAIR, describe_difference
from app.learning.effort import EffortParameters
from app.learning.performance import LearningDemonstration
from app.learning.performance_conflict import contradiction_words
from app.storage import emit
from app.storage.tables import Demonstration, JobRow, Metric, PolicyRow, Query, Run, RunCheckpoint, Segmentation, ToolRow
from app.workflow.authors import shown_name
from app.workflow.consistency import consistency, ill_fitting
from app.workflow.exceptions import settle
from app.workflow.feature_choice import stored_features
from app.workflow.lookup import current_segmentation, found, same_regions
from app.workflow.run_rows import (
    TRAINING_JOB,
    checkpoint_of,
    current_answer,
    demonstrations_of,
    go,
    learner,
    parameters_for,
    train_on,
    write_policy,
)
from app.workflow.training_step import LIKELIHOOD, Asked, Outcome, Parameters, Step, compute
from app.workflow.values import Values, interactions_from

Json = dict[str, Any]

KIND = TRAINING_JOB


def handler(values: Values) -> Handler:
    """How training jobs are done."""
    return Handler(partial(prepare, values), compute, partial(finish, values), fail, begin)


def begin(session: Session, job: JobRow) -> None:
    """The run trains from here on."""
    row = session.get(Run, job.subject_id)
    if row is not None and row.state == "queued":
        go(session, row, "training", "Comparing your orders with others.")


def prepare(values: Values, session: Session, job: JobRow) -> Step | None:
    """The step that comes next; None when the run is over."""
    row = session.get(Run, job.subject_id)
    if row is None or row.state not in ("queued", "training"):
        return None
    interactions = interactions_from(row.interactions)
    features = stored_features(session, row.features) if row.features else None
    demonstrations, keys = [], []
    for shown in demonstrations_of(session, row.id):
        cut = found(session, Segmentation, shown.segmentation_id, "segmentation")
        demonstrations.append(LearningDemonstration(values.problem(session, cut, interactions, features), tuple(shown.sequence)))
        keys.append((cut.id, row.features, interactions))
    checkpoint = checkpoint_of(session, row)
    base = session.get(PolicyRow, row.based_on) if row.based_on else None
    cuts = [found(session, Segmentation, key, "segmentation") for key in row.interest]
    return Step(
        run_id=row.id,
        kind=LIKELIHOOD if job.args.get(LIKELIHOOD) else row.kind,
        keys=tuple(keys),
        demonstrations=tuple(demonstrations),
        parameters=_parameters(row),
        seed=row.seed,
        state=checkpoint.state if checkpoint else None,
        answers=_answers(session, row.id),
        base=tuple(base.weights) if base else (),
        tools=tuple(values.problem(session, cut, interactions, features) for cut in cuts),
        tool_keys=tuple((cut.id, row.features, interactions) for cut in cuts),
        gone=frozenset(k for k, cut in enumerate(cuts) if _is_gone(session, cut)),
    )


def _parameters(row: Run) -> Parameters:
    """As a person set them; an effort run in the paper's mode compares sequences of all tools with one threshold."""
    given = parameters_for(learner(row), row.params)
    return replace(given, pooled=row.mode == "paper") if isinstance(given, EffortParameters) else given


def _is_gone(session: Session, cut: Segmentation) -> bool:
    """Whether a tool was deleted or cut into other regions since the run started."""
    tool, now = session.get(ToolRow, cut.tool_id), current_segmentation(session, cut.tool_id)
    return tool is None or tool.deleted_at is not None or now is None or not same_regions(session, cut.id, now)


def finish(values: Values, session: Session, job: JobRow, out: Outcome) -> None:
    """Checkpoint, metrics, questions, state and next job, all or nothing."""
    row = session.get(Run, job.subject_id)
    if row is None or row.state not in ("queued", "training"):
        return
    if _outdated(session, row, out):
        return train_on(session, row, "Going on with the order you recorded meanwhile.")
    if out.outcome == "compromise":
        return _settle(session, row, out)
    for iteration, loss, terms, violations in out.metrics:
        session.merge(Metric(run_id=row.id, iteration=iteration, loss=loss, terms=terms, violations=violations))
    if out.interactions is not None:
        row.interactions = [{"first": i.first, "second": i.second} for i in out.interactions]
    row.iteration = out.iteration
    row.checkpoint += 1
    if out.questions:
        _ask(values, session, row, out.questions)
    session.add(_checkpoint(session, row, out))
    if out.outcome == "training":
        go(session, row, "training", out.message)
        add_job(session, KIND, row.project_id, row.id, job.title)
    elif out.outcome == "questions":
        go(session, row, "waiting_for_expert", _words(session, row, out))
    else:
        _close(session, row, out)


def _outdated(session: Session, row: Run, out: Outcome) -> bool:
    """Whether an order was recorded for a certified run while the step was under way."""
    learned_from = (out.report or {}).get("slack")
    return learned_from is not None and len(learned_from) != len(demonstrations_of(session, row.id))


def fail(session: Session, job: JobRow, error: dict[str, str]) -> None:
    """The run stops; it can be resumed from its last checkpoint."""
    row = session.get(Run, job.subject_id)
    if row is not None and row.state in ("queued", "training"):
        row.error = error
        go(session, row, "failed", error["detail"])


def _answers(session: Session, run_id: str) -> dict[str, str]:
    queries = session.exec(select(Query).where(Query.run_id == run_id, Query.state == "answered").order_by(col(Query.id)))
    return {query.fingerprint: answer.value for query in queries.all() if (answer := current_answer(session, query.id))}


def _checkpoint(session: Session, row: Run, out: Outcome) -> RunCheckpoint:
    before = session.get(RunCheckpoint, (row.id, row.checkpoint - 1))
    kept = {"interactions": before.report["interactions"]} if before and before.report and "interactions" in before.report else {}
    return RunCheckpoint(
        report=None if out.report is None else {**kept, **_named(session, row, out.report)},
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
        query = known.get(asked.fingerprint) or _new_query(values, session, row, shown, asked, number)
        if not again:
            query.round, query.number = row.round, number
        query.state, query.checkpoint = "open", row.checkpoint
        session.add(query)
        session.flush()
        emit(session, "query.changed", row.project_id, query_id=query.id, run_id=row.id)


def _new_query(values: Values, session: Session, row: Run, shown: list[Demonstration], asked: Asked, number: int) -> Query:
    """The question as a row, with the difference in words."""
    demonstration = None if asked.demonstration is None else shown[asked.demonstration]
    key = row.interest[asked.tool or 0] if demonstration is None else demonstration.segmentation_id
    cut = found(session, Segmentation, key, "segmentation")
    tool = values.tool(session, cut)
    names, descriptions = [r.name for r in tool.regions], [r.description for r in tool.regions]
    kind = _question_kind(row, demonstration)
    words = describe_difference(names, descriptions, asked.left, asked.right, *([] if kind == "similarity" else [PAIR]))
    return Query(
        run_id=row.id,
        project_id=row.project_id,
        tool_id=cut.tool_id,
        demonstration_id=None if demonstration is None else demonstration.id,
        kind=kind,
        round=row.round,
        checkpoint=row.checkpoint,
        number=number,
        left=list(asked.left),
        right=list(asked.right),
        why=asked.why,
        difference=words,
        differs=list(asked.differs),
        fingerprint=asked.fingerprint,
    )


def _question_kind(row: Run, demonstration: Demonstration | None) -> str:
    if demonstration is None:
        return "closer" if row.kind == "exception" else "pair"
    return "similarity" if row.kind == "performance" else "preference"


def _named(session: Session, row: Run, report: Json) -> Json:
    """A certificate with the tools it speaks of: demonstrated ones beside their slack, the others with their chances."""
    shown = demonstrations_of(session, row.id)

    def name(shown: Demonstration) -> Json:
        return {"tool_id": shown.tool_id, "tool_name": _order_name(session, row, shown), "sequence": list(shown.sequence)}

    ties = report["class_sizes"] or [None] * len(shown)
    demonstrated = [
        {**name(d), "slack": slack, "ties": size} for d, slack, size in zip(shown, report["slack"] or [0.0] * len(shown), ties, strict=True)
    ]
    tools = _named_tools(session, row, report["tools"])
    conflicts = [
        {
            "tools": [{**name(shown[i]), "slack": x} for i, x in zip(c["members"], c["slack"], strict=True)],
            "resolved": c["resolved"],
        }
        for c in report["conflicts"]
    ]
    left_out = {"slack", "class_sizes", "identifiable", "repeated", "repeated_alike"}
    return {
        **{k: v for k, v in report.items() if k not in left_out},
        "demonstrations": demonstrated,
        "tools": tools,
        "conflicts": conflicts,
        "unclear": ill_fitting(session, row, report["unclear"]),
        "consistency": consistency(session, shown, report["repeated"], report["repeated_alike"]),
    }


def _named_tools(session: Session, row: Run, tools: list[Json]) -> list[Json]:
    """How sure the choice is on each tool of interest, with its name."""
    named = []
    for entry in tools:
        tool_id = found(session, Segmentation, row.interest[entry["tool"]], "segmentation").tool_id
        name = found(session, ToolRow, tool_id, "tool").name
        named.append({"tool_id": tool_id, "tool_name": name, **{k: v for k, v in entry.items() if k != "tool"}})
    return named


def _close(session: Session, row: Run, out: Outcome) -> None:
    """The end of a run, with a policy if it converged."""
    if out.outcome == "converged" and row.kind == "exception":
        settle(session, row, out.state, len(_answers(session, row.id)))
    elif out.outcome == "converged":
        write_policy(session, row, list(out.weights), list(out.identifiable), converged=True)
    elif out.outcome == "infeasible":
        shown, found_odd = demonstrations_of(session, row.id), out.contradiction.odd if out.contradiction else ()
        row.error = {
            "error": "ContradictoryAnswers",
            "detail": _words(session, row, out),
            "tools": list(dict.fromkeys(shown[i].tool_id for i in found_odd)),
        }
    go(session, row, out.outcome, _words(session, row, out))


def _settle(session: Session, row: Run, out: Outcome) -> None:
    """The policy of orders that contradict each other: on the features that predict them best, without interactions."""
    policy = write_policy(session, row, list(out.weights), list(out.identifiable), converged=False)
    before, report = checkpoint_of(session, row), out.report or {}
    kept = {key: before.report[key] for key in ("conflicts", "interactions") if key in before.report} if before and before.report else {}
    policy.feature_set, policy.interactions = out.features or policy.feature_set, []
    policy.certificate = {**kept, **report, "tools": _named_tools(session, row, report.get("tools", []))}
    session.add(policy)
    go(session, row, "converged", out.message)


def _words(session: Session, row: Run, out: Outcome) -> str:
    """What a step says, with the names of the tools where it says which demonstrations contradict each other."""
    if out.contradiction is None or out.outcome not in ("questions", "infeasible"):
        return out.message
    names = [_order_name(session, row, shown) for shown in demonstrations_of(session, row.id)]
    words = contradiction_words(out.contradiction, names)
    return words if out.outcome == "infeasible" else f"Is the other order just as good? {words}"


def _order_name(session: Session, row: Run, shown: Demonstration) -> str:
    """What an order is called: its tool, and whose it is where a run learns from several experts."""
    name = found(session, ToolRow, shown.tool_id, "tool").name
    return f"{name} by {shown_name(shown.author)}" if len(row.authors) > 1 else name
