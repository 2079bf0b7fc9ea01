"""Questions and answers. An answer closes its question, moves the run on and queues the next step in one transaction."""

from typing import Any

from sqlmodel import Session, col, delete, select

from app.errors import AlreadyAnswered, Conflict, InvalidInput
from app.jobs.rows import cancel_jobs
from app.learning.differences import regions_to_mark
from app.storage import emit
from app.storage.tables import ACTIVE_RUN_STATES, Answer, Demonstration, Metric, Project, Query, Run, RunCheckpoint, ToolRow
from app.workflow.context import Context
from app.workflow.exceptions import forget
from app.workflow.lookup import active_run, check_tools, found, present
from app.workflow.run_rows import current_answer, go, open_queries, store_answer, train_on, withdraw

Json = dict[str, Any]

TITLES = {
    "similarity": "Would the right order be just as good as yours?",
    "preference": "Which of these two orders is less effort for you?",
    "pair": "Which of these two orders would you work in?",
    "closer": "Which of these two comes closer to how you would do this tool?",
}
CHOICES: dict[str, list[Json]] = {
    "similarity": [
        {"value": "similar", "label": "Yes, just as good", "hint": "either is fine", "key": "1"},
        {"value": "not_similar", "label": "No, mine is better", "hint": "the order matters here", "key": "2"},
        {"value": "cant_tell", "label": "Can't tell", "hint": "", "key": "0"},
    ],
    "preference": [
        {"value": "left", "label": "The left one", "hint": "less reaching and walking", "key": "1"},
        {"value": "right", "label": "The right one", "hint": "less reaching and walking", "key": "2"},
        {"value": "equal", "label": "About equal", "hint": "", "key": "3"},
        {"value": "cant_tell", "label": "Can't tell", "hint": "", "key": "0"},
    ],
}
CHOICES["pair"] = [
    {"value": "left", "label": "The left one", "hint": "it is my way", "key": "1"},
    {"value": "right", "label": "The right one", "hint": "it is my way", "key": "2"},
    {"value": "equal", "label": "About equal", "hint": "either is fine", "key": "3"},
    {"value": "both_wrong", "label": "Both are wrong", "hint": "I would show another order", "key": "4"},
    {"value": "cant_tell", "label": "Can't tell", "hint": "", "key": "0"},
]
CHOICES["closer"] = [
    {"value": "left_mine", "label": "The left one is my way", "hint": "it counts for this tool", "key": "1"},
    {"value": "right_mine", "label": "The right one is my way", "hint": "it counts for this tool", "key": "2"},
    {"value": "left", "label": "Left is closer", "hint": "", "key": "3"},
    {"value": "right", "label": "Right is closer", "hint": "", "key": "4"},
    {"value": "equal", "label": "Equally far", "hint": "", "key": "5"},
    {"value": "cant_tell", "label": "Can't tell", "hint": "", "key": "0"},
]
SIDES = {
    "similarity": (("Yours", "{name}, recorded"), ("Other", "by what is learned so far at least as good")),
    "preference": (("Left", "both are equally good"), ("Right", "both are equally good")),
    "closer": (("Left", "one way to do it"), ("Right", "another way")),
    "pair": (("Left", "{who} recorded this tool"), ("Right", "{who} recorded this tool")),
}


def list_queries(ctx: Context, run_id: str | None = None, project_id: str | None = None, state: str | None = None) -> list[Json]:
    """Questions of a run or a project, oldest first."""

    def query(session: Session) -> list[Json]:
        wanted = select(Query).order_by(col(Query.checkpoint), col(Query.number))
        if run_id is not None:
            found(session, Run, run_id, "run")
            wanted = wanted.where(Query.run_id == run_id)
        if project_id is not None:
            present(session, Project, project_id)
            wanted = wanted.where(Query.project_id == project_id).order_by(None).order_by(col(Query.id))
        if state is not None:
            wanted = wanted.where(Query.state == state)
        return [query_json(session, row) for row in session.exec(wanted).all()]

    return ctx.store.read(query)


def get_query(ctx: Context, query_id: str) -> Json:
    """One question."""
    return ctx.store.read(lambda session: query_json(session, found(session, Query, query_id, "question")))


def answer(ctx: Context, query_id: str, value: str, client_key: str | None = None) -> Json:
    """Answer a question. The first answer counts; repeating it with its client key gives the same row again.

    Raises:
        AlreadyAnswered: Someone was faster.
        Conflict: The question is no longer asked.
        InvalidInput: The value belongs to another kind of question.
    """

    def change(session: Session) -> Json:
        query = found(session, Query, query_id, "question")
        run = found(session, Run, query.run_id, "run")
        _check_value(query, value)
        given = current_answer(session, query.id)
        if given is not None:
            if client_key is not None and given.client_key == client_key and given.value == value:
                return answer_json(given, run)
            raise AlreadyAnswered(
                f"This question was answered before: {_label(query.kind, given.value)}. Take that answer back to change it."
            )
        if query.state != "open" or run.state != "waiting_for_expert":
            raise Conflict("This question is no longer asked: the run it belongs to was stopped or went another way.")
        row = store_answer(session, query.id, value, client_key)
        query.state = "answered"
        session.add(query)
        session.flush()
        emit(session, "query.changed", query.project_id, query_id=query.id, run_id=run.id)
        left = len(open_queries(session, run.id))
        if left:
            go(session, run, "waiting_for_expert", f"Waiting for {left} more answer{'s' if left > 1 else ''}.")
        else:
            train_on(session, run, "Going on with your answers.")
        return answer_json(row, run)

    return ctx.store.write(change)


def undo_answer(ctx: Context, answer_id: str, keep_later: bool = False) -> Json:
    """Take an answer back: the question is open again. A run that had moved on returns to where it asked.

    Args:
        ctx: Where.
        answer_id: The answer.
        keep_later: Answers that were given later stay; only for pairs, whose answers count side by side.

    Raises:
        Conflict: The answer doesn't count any more, or the run can't be taken up.
    """

    def change(session: Session) -> Json:
        row = found(session, Answer, answer_id, "answer")
        query = found(session, Query, row.query_id, "question")
        run = found(session, Run, query.run_id, "run")
        if row.value == "undone" or row.superseded_by is not None:
            raise Conflict("This answer was taken back before.")
        if query.state != "answered" or run.state == "cancelled":
            raise Conflict("The run this answer belongs to was stopped; let it go on first.")
        if keep_later and query.kind != "pair":
            raise InvalidInput(
                "Only an answer to which of two orders is better can be taken back by itself; take it back with the later ones."
            )
        _check_can_go_back(session, run)
        cancel_jobs(session, run.id)
        store_answer(session, query.id, "undone")
        if not keep_later:
            _go_back(session, run, query.checkpoint)
        query.state = "open"
        session.add(query)
        session.flush()
        emit(session, "query.changed", query.project_id, query_id=query.id, run_id=run.id)
        run.error, run.policy_id = None, None
        forget(session, run)
        go(session, run, "waiting_for_expert", "The answer was taken back; the question is open again.")
        return query_json(session, query)

    return ctx.store.write(change)


def query_json(session: Session, row: Query) -> Json:
    """The question as REST shows it."""
    tool = found(session, ToolRow, row.tool_id, "tool")
    shown = found(session, Demonstration, row.demonstration_id, "demonstration") if row.demonstration_id else None
    given = current_answer(session, row.id)
    together = session.exec(select(Query.id).where(Query.run_id == row.run_id, Query.round == row.round, Query.state != "withdrawn")).all()
    (left, left_note), (right, right_note) = SIDES[row.kind]
    about = {"name": shown.name if shown else "", "who": _nobody(found(session, Run, row.run_id, "run"))}
    return {
        "id": row.id,
        "run_id": row.run_id,
        "project_id": row.project_id,
        "kind": row.kind,
        "state": row.state,
        "tool_id": row.tool_id,
        "tool_name": tool.name,
        "title": TITLES[row.kind],
        "left": {"label": left, "note": left_note.format(**about), "sequence": row.left},
        "right": {"label": right, "note": right_note.format(**about), "sequence": row.right},
        "difference": row.difference,
        "why": row.why,
        "differs": row.differs,
        "marked": list(regions_to_mark(tuple(row.left), tuple(row.right))),
        "number": row.number,
        "of": max(len(together), row.number),
        "choices": CHOICES[row.kind],
        "answer": None if given is None else {"id": given.id, "value": given.value, "created_at": given.created_at},
    }


def answer_json(row: Answer, run: Run) -> Json:
    """The answer as REST shows it."""
    return {"id": row.id, "query_id": row.query_id, "value": row.value, "created_at": row.created_at, "run_state": run.state}


def _go_back(session: Session, run: Run, checkpoint: int) -> None:
    """Forget what came after a checkpoint; questions asked since are withdrawn."""
    if run.checkpoint == checkpoint:
        return
    later = select(Query).where(Query.run_id == run.id, col(Query.checkpoint) > checkpoint, Query.state != "withdrawn")
    for query in session.exec(later).all():
        withdraw(session, query)
    back = session.get(RunCheckpoint, (run.id, checkpoint))
    assert back is not None
    session.exec(delete(RunCheckpoint).where(col(RunCheckpoint.run_id) == run.id, col(RunCheckpoint.number) > checkpoint))
    session.exec(delete(Metric).where(col(Metric.run_id) == run.id, col(Metric.iteration) > back.iteration))
    run.checkpoint, run.round, run.iteration = checkpoint, back.round, back.iteration


def _check_can_go_back(session: Session, run: Run) -> None:
    other = active_run(session, run.project_id)
    if other is not None and other.id != run.id:
        raise Conflict("Another run of this project is not at its end. Stop it first, then take the answer back.")
    if run.state not in ACTIVE_RUN_STATES:
        check_tools(session, run)


def _check_value(query: Query, value: str) -> None:
    accepted = [choice["value"] for choice in CHOICES[query.kind]]
    if value not in accepted:
        raise InvalidInput(f"This question is answered with {', '.join(accepted)}, not {value!r}.")


def _label(kind: str, value: str) -> str:
    return next(choice["label"] for choice in CHOICES[kind] if choice["value"] == value)


def _nobody(run: Run) -> str:
    """Who has not recorded the tools that a run asks about."""
    return f"{' or '.join(run.authors)} hasn't" if run.authors else "nobody has"
