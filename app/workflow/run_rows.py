"""Runs as REST shows them, and the changes of state that several actions share."""

from typing import Any

from sqlmodel import Session, col, func, select

from app.errors import InvalidInput
from app.jobs.rows import add_job
from app.learning.certified_state import CERTIFIED_WORDS, CertifiedParameters
from app.learning.effort import EFFORT_WORDS, EffortParameters
from app.learning.exception_run import EXCEPTION_WORDS, ExceptionParameters
from app.learning.performance import PARAMETER_WORDS, PerformanceParameters
from app.sequencing.features import FEATURE_SETS
from app.storage import emit
from app.storage.identity import now
from app.storage.tables import (
    Answer,
    Demonstration,
    Metric,
    PolicyRow,
    Query,
    Run,
    RunCheckpoint,
    RunDemonstration,
    Segmentation,
    ToolRow,
)

Json = dict[str, Any]

TRAINING_JOB = "training"
Parameters = PerformanceParameters | CertifiedParameters | EffortParameters | ExceptionParameters
PARAMETERS: dict[str, type[Parameters]] = {
    "certified": CertifiedParameters,
    "paper": PerformanceParameters,
    "effort": EffortParameters,
    "exception": ExceptionParameters,
}
WORDS: dict[str, dict[str, tuple[str, str]]] = {
    "certified": CERTIFIED_WORDS,
    "paper": PARAMETER_WORDS,
    "effort": EFFORT_WORDS,
    "exception": EXCEPTION_WORDS,
}
TITLES = {
    "performance": "Learning from your orders",
    "effort": "Learning what is effort",
    "exception": "Looking for your order on one tool",
}
MODES = ("certified", "paper")  # of a performance run, the default first
MOST: dict[str, int] = {"iterations": 5000, "samples": 1000, "classes": 50, "rounds": 200, "batch": 50, "most": 200, "cap": 5000}
UP_TO_ONE = ("zeta", "tolerance")


def learner(row: Run) -> str:
    """Which learner a run has, as `PARAMETERS` names them."""
    return row.mode if row.kind == "performance" else row.kind


def parameters_for(learns: str, params: Json) -> Parameters:
    """Hyperparameters from what a person gave; the rest has default values.

    Raises:
        InvalidInput: An unknown name or a value out of range; says what is accepted.
    """
    defaults = PARAMETERS[learns]()
    known: dict[str, int | float] = {}
    for key, value in params.items():
        if key not in WORDS[learns]:
            raise InvalidInput(f"There is no parameter {key!r}. Known are: {', '.join(WORDS[learns])}.")
        whole = isinstance(getattr(defaults, key), int)
        if isinstance(getattr(defaults, key), bool):
            if value not in (0, 1):
                raise InvalidInput(f"“{WORDS[learns][key][1]}” is true or false, not {value!r}.")
            known[key] = bool(value)
            continue
        label, most = WORDS[learns][key][1], MOST.get(key, 1 if key in UP_TO_ONE else 1_000_000)
        if isinstance(value, bool) or (whole and value != int(value)):
            raise InvalidInput(f"{label} is a {'whole number' if whole else 'number'}, not {value!r}.")
        if not (1 if whole else 0) <= value <= most:
            raise InvalidInput(f"{label} is between {1 if whole else 0} and {most:,}, not {value}.")
        known[key] = int(value) if whole else float(value)
    return PARAMETERS[learns](**known)  # pyright: ignore[reportArgumentType]


def parameter_rows(learns: str, params: Json) -> list[Json]:
    """Hyperparameters with symbol and words."""
    values, defaults = parameters_for(learns, params), PARAMETERS[learns]()
    return [
        {
            "key": key,
            "symbol": symbol,
            "label": label,
            "value": getattr(values, key),
            "default": getattr(defaults, key),
        }
        for key, (symbol, label) in WORDS[learns].items()
    ]


def run_json(session: Session, row: Run) -> Json:
    """The run as REST shows it."""
    last = session.exec(select(Metric).where(Metric.run_id == row.id).order_by(col(Metric.iteration).desc()).limit(1)).first()
    states = dict(session.exec(select(Query.state, func.count()).where(Query.run_id == row.id).group_by(Query.state)).all())
    tools = select(RunDemonstration.tool_id).where(RunDemonstration.run_id == row.id).order_by(col(RunDemonstration.position))
    return {
        "id": row.id,
        "project_id": row.project_id,
        "kind": row.kind,
        "authors": row.authors,
        "mode": row.mode if row.kind == "performance" else None,
        "state": row.state,
        "round": row.round,
        "iteration": row.iteration,
        "loss": last.loss if last else None,
        "terms": last.terms if last else None,
        "violations": last.violations if last else None,
        "seed": row.seed,
        "params": row.params,
        "parameters": parameter_rows(learner(row), row.params),
        "open_queries": states.get("open", 0),
        "asked": states.get("open", 0) + states.get("answered", 0),
        "answered": states.get("answered", 0),
        "policy_id": row.policy_id,
        "message": row.message,
        "error": row.error,
        "report": checkpoint.report if (checkpoint := checkpoint_of(session, row)) else None,
        "tools": list(session.exec(tools)),
        "about": _about(session, row),
        "to_show": _to_show(session, row),
        "version": row.version,
        "created_at": row.created_at,
        "updated_at": row.updated_at,
    }


def _about(session: Session, row: Run) -> str | None:
    """The tool a run about one tool asks about."""
    return found_tool(session, row.interest[0]) if row.kind == "exception" else None


def found_tool(session: Session, segmentation_id: str) -> str:
    """The tool of a segmentation."""
    cut = session.get(Segmentation, segmentation_id)
    assert cut is not None
    return cut.tool_id


def demonstrations_of(session: Session, run_id: str) -> list[Demonstration]:
    """What a run trains on, in its order."""
    wanted = select(Demonstration).join(RunDemonstration, col(RunDemonstration.demonstration_id) == col(Demonstration.id))
    return list(session.exec(wanted.where(RunDemonstration.run_id == run_id).order_by(col(RunDemonstration.position))))


def wrong_both(session: Session, row: Run) -> list[str]:
    """Tools on which both orders of a question were wrong, in the order asked."""
    wanted = select(Query).where(Query.run_id == row.id, Query.kind == "pair", Query.state == "answered").order_by(col(Query.id))
    told = [(q.tool_id, current_answer(session, q.id)) for q in session.exec(wanted).all()]
    return list(dict.fromkeys(tool_id for tool_id, given in told if given is not None and given.value == "both_wrong"))


def _to_show(session: Session, row: Run) -> list[Json]:
    """Tools whose order a run waits to be shown."""
    shown = set(session.exec(select(RunDemonstration.tool_id).where(RunDemonstration.run_id == row.id)))
    tools = [session.get(ToolRow, key) for key in wrong_both(session, row) if key not in shown]
    return [{"tool_id": tool.id, "tool_name": tool.name} for tool in tools if tool is not None and tool.deleted_at is None]


def go(session: Session, row: Run, state: str, message: str | None = None) -> None:
    """Change the state of a run and tell of it."""
    row.state = state
    if message is not None:
        row.message = message
    row.version, row.updated_at = row.version + 1, now()
    session.add(row)
    session.flush()
    emit(session, "run.changed", row.project_id, run_id=row.id, state=state)


def train_on(session: Session, row: Run, message: str, args: Json | None = None) -> None:
    """Let the run compute its next step."""
    row.error = None
    go(session, row, "training" if row.checkpoint else "queued", message)
    add_job(
        session,
        TRAINING_JOB,
        row.project_id,
        row.id,
        TITLES[row.kind],
        args or {},
    )


def current_answer(session: Session, query_id: str) -> Answer | None:
    """The answer that counts; None when there is none or it was taken back."""
    row = latest_answer(session, query_id)
    return None if row is None or row.value == "undone" else row


def latest_answer(session: Session, query_id: str) -> Answer | None:
    """The last row of a query's answers, "undone" ones too."""
    return session.exec(select(Answer).where(Answer.query_id == query_id, col(Answer.superseded_by).is_(None))).first()


def store_answer(session: Session, query_id: str, value: str, client_key: str | None = None) -> Answer:
    """Add an answer; what counted before is superseded."""
    fresh = Answer(query_id=query_id, value=value, client_key=client_key)
    before = latest_answer(session, query_id)
    if before is not None:
        before.superseded_by = fresh.id
        session.add(before)
        session.flush()
    session.add(fresh)
    session.flush()
    return fresh


def withdraw(session: Session, query: Query) -> None:
    """A question that is no longer asked; an answer to it no longer counts."""
    if current_answer(session, query.id) is not None:
        store_answer(session, query.id, "undone")
    query.state = "withdrawn"
    session.add(query)
    session.flush()
    emit(session, "query.changed", query.project_id, query_id=query.id, run_id=query.run_id)


def open_queries(session: Session, run_id: str) -> list[Query]:
    """Questions of a run that wait."""
    return list(session.exec(select(Query).where(Query.run_id == run_id, Query.state == "open").order_by(col(Query.id))))


def write_policy(session: Session, row: Run, weights: list[float], identifiable: list[bool], *, converged: bool) -> PolicyRow:
    """What a run learned, as a policy; an effort run adds its weights to the policy it built on."""
    first = session.exec(select(RunDemonstration).where(RunDemonstration.run_id == row.id).order_by(col(RunDemonstration.position))).first()
    assert first is not None
    demonstration = session.get(Demonstration, first.demonstration_id)
    assert demonstration is not None
    cut = session.get(Segmentation, demonstration.segmentation_id)
    assert cut is not None
    count = session.exec(select(func.count()).select_from(PolicyRow).where(PolicyRow.project_id == row.project_id)).one()
    learned = {
        "demonstrations": session.exec(select(func.count()).select_from(RunDemonstration).where(RunDemonstration.run_id == row.id)).one(),
        "answers": session.exec(select(func.count()).select_from(Query).where(Query.run_id == row.id, Query.state == "answered")).one(),
    }
    base = session.get(PolicyRow, row.based_on) if row.based_on else None
    policy = PolicyRow(
        project_id=row.project_id,
        run_id=row.id,
        name=f"Policy {count + 1}" if base is None else f"Policy {count + 1}, with effort",
        feature_set=base.feature_set if base else row.features or cut.feature_set,
        feature_version=base.feature_version if base else FEATURE_SETS[cut.feature_set].version,
        interactions=row.interactions,
        weights=weights if base is None else base.weights,
        identifiable=identifiable if base is None else base.identifiable,
        effort_weights=None if base is None else weights,
        converged=converged,
        certificate=base.certificate if base else checkpoint.report if (checkpoint := _last_checkpoint(session, row)) else None,
        learned_from=learned if base is None else {**learned, "answers": learned["answers"] + base.learned_from["answers"]},
    )
    session.add(policy)
    session.flush()
    row.policy_id = policy.id
    emit(session, "policy.changed", row.project_id, policy_id=policy.id)
    return policy


def _last_checkpoint(session: Session, row: Run) -> RunCheckpoint | None:
    session.flush()  # the one of this very step was only added
    return checkpoint_of(session, row)


def checkpoint_of(session: Session, row: Run) -> RunCheckpoint | None:
    """Where the run goes on from."""
    return session.get(RunCheckpoint, (row.id, row.checkpoint)) if row.checkpoint else None
