"""Runs: starting a learner, following it, stopping it, taking it up again. Questions and answers are in `queries`."""

from typing import Any

from sqlmodel import Session, col, select

from app.errors import Conflict, InvalidInput
from app.jobs.rows import cancel_jobs
from app.learning.soft_graph import MOST_REGIONS
from app.sequencing.features import base_name
from app.storage.tables import (
    ACTIVE_RUN_STATES,
    Demonstration,
    Metric,
    PolicyRow,
    Project,
    Run,
    RunDemonstration,
    Segmentation,
    ToolRow,
)
from app.workflow.authors import orders_by
from app.workflow.context import Context
from app.workflow.feature_choice import ANY_TOOL, project_features
from app.workflow.lookup import check_tools, current_segmentation, found, present, refuse_while_training, standing, tools_of
from app.workflow.queries import answer, get_query, list_queries, undo_answer
from app.workflow.run_rows import (
    MODES,
    checkpoint_of,
    demonstrations_of,
    go,
    open_queries,
    parameter_rows,
    parameters_for,
    run_json,
    train_on,
    withdraw,
    write_policy,
)
from app.workflow.training_step import LIKELIHOOD

__all__ = [
    "answer",
    "cancel",
    "finish_run",
    "get_query",
    "get_run",
    "list_queries",
    "list_runs",
    "metrics",
    "resume",
    "run_defaults",
    "start_run",
    "undo_answer",
]

Json = dict[str, Any]

DEFAULT_SEED = 1
KINDS = ("performance", "effort")


def run_defaults(ctx: Context, project_id: str, kind: str, mode: str = MODES[0]) -> Json:
    """The hyperparameters a new run would have."""
    learns = _learner(kind, mode)
    ctx.store.read(lambda session: present(session, Project, project_id).id)
    return {"parameters": parameter_rows(learns, {})}


def start_run(
    ctx: Context,
    project_id: str,
    kind: str,
    params: Json | None = None,
    seed: int | None = None,
    mode: str = MODES[0],
    authors: list[str] | None = None,
) -> Json:
    """Start a learner on the demonstrations that count now, those of the named experts or of all.

    Raises:
        InvalidInput: Nothing to learn from, nobody of that name, or an effort run without a policy to build on.
        RunActive: Another run of the project is not at its end.
    """
    parameters_for(_learner(kind, mode), params or {})

    def change(session: Session) -> Json:
        project = present(session, Project, project_id)
        refuse_while_training(session, project)
        base = _latest_policy(session, project_id) if kind == "effort" else None
        names, shown = _demonstrations(session, project_id, base, authors or [])
        row = Run(
            project_id=project_id,
            kind=kind,
            mode=mode,
            authors=names,
            interest=_interest(session, project_id, shown) if kind == "performance" and mode == "certified" else [],
            seed=DEFAULT_SEED if seed is None else seed,
            params=params or {},
            interactions=base.interactions if base else project.interactions,
            features=base.feature_set if base else _features(session, project_id, shown),
            based_on=base.id if base else None,
        )
        session.add(row)
        session.flush()
        for position, demonstration in enumerate(shown):
            session.add(
                RunDemonstration(run_id=row.id, position=position, demonstration_id=demonstration.id, tool_id=demonstration.tool_id)
            )
        train_on(session, row, "Waiting to start.")
        return run_json(session, row)

    return ctx.store.write(change)


def list_runs(ctx: Context, project_id: str) -> list[Json]:
    """The runs of a project, newest first."""

    def query(session: Session) -> list[Json]:
        present(session, Project, project_id)
        rows = session.exec(select(Run).where(Run.project_id == project_id).order_by(col(Run.id).desc())).all()
        return [run_json(session, row) for row in rows]

    return ctx.store.read(query)


def get_run(ctx: Context, run_id: str) -> Json:
    """One run."""
    return ctx.store.read(lambda session: run_json(session, found(session, Run, run_id, "run")))


def metrics(ctx: Context, run_id: str, after: int = 0) -> list[Json]:
    """The learning curve behind an iteration."""

    def query(session: Session) -> list[Json]:
        found(session, Run, run_id, "run")
        wanted = select(Metric).where(Metric.run_id == run_id, col(Metric.iteration) > after).order_by(col(Metric.iteration))
        return [{"iteration": m.iteration, "loss": m.loss, "terms": m.terms, "violations": m.violations} for m in session.exec(wanted)]

    return ctx.store.read(query)


def cancel(ctx: Context, run_id: str) -> Json:
    """Stop a run; its open questions are withdrawn."""

    def change(session: Session) -> Json:
        row = found(session, Run, run_id, "run")
        if row.state not in ACTIVE_RUN_STATES:
            raise Conflict(f"This run is at its end ({row.state}); there is nothing to stop.")
        cancel_jobs(session, row.id)
        for query in open_queries(session, row.id):
            withdraw(session, query)
        go(session, row, "cancelled", "Stopped. It can go on from where it was.")
        return run_json(session, row)

    return ctx.store.write(change)


def resume(ctx: Context, run_id: str) -> Json:
    """Go on from the last checkpoint of a failed or stopped run."""

    def change(session: Session) -> Json:
        row = found(session, Run, run_id, "run")
        if row.state not in ("failed", "cancelled"):
            raise Conflict(f"Only a failed or stopped run can go on; this one is {row.state.replace('_', ' ')}.")
        refuse_while_training(session, found(session, Project, row.project_id, "project"))
        check_tools(session, row)
        train_on(session, row, "Going on.")
        return run_json(session, row)

    return ctx.store.write(change)


def finish_run(ctx: Context, run_id: str) -> Json:
    """Take what a stalled run has learned: all it could still ask about was called just as good.

    An infeasible run can be finished too, as a compromise; the policy says that it did not converge. In the paper's mode these are
    the weights it had; otherwise what predicts the contradicting orders best is learned in the background.
    """

    def change(session: Session) -> Json:
        row = found(session, Run, run_id, "run")
        checkpoint = checkpoint_of(session, row)
        if row.state not in ("stalled", "infeasible") or checkpoint is None:
            raise Conflict(f"Only a run that found nothing left to learn can be finished; this one is {row.state.replace('_', ' ')}.")
        if row.state == "infeasible" and row.mode == "certified" and _small_enough(session, row):
            train_on(session, row, "Looking for what predicts your orders best.", {LIKELIHOOD: True})
            return run_json(session, row)
        write_policy(session, row, checkpoint.weights, checkpoint.identifiable, converged=False)
        words = "Finished with what was learned so far." if row.state == "stalled" else _compromise_words(session, row)
        if row.state == "infeasible" and row.mode == "certified":
            words += (
                f" A tool has more than {MOST_REGIONS} regions, so exceptions can't be allowed for; these weights break the orders least."
            )
        row.error = None
        go(session, row, "converged", words)
        return run_json(session, row)

    return ctx.store.write(change)


def _small_enough(session: Session, row: Run) -> bool:
    """Whether likelihood can be computed on every tool of a run."""
    cuts = [found(session, Segmentation, d.segmentation_id, "segmentation") for d in demonstrations_of(session, row.id)]
    return all(cut.region_count <= MOST_REGIONS for cut in cuts)


def _compromise_words(session: Session, row: Run) -> str:
    names = [found(session, ToolRow, key, "tool").name for key in (row.error or {}).get("tools", [])]
    between = f" ({', '.join(names)})" if names else ""
    return f"Finished with the best compromise between orders that contradict each other{between}."


def _learner(kind: str, mode: str) -> str:
    """Which learner is meant, as `run_rows` names them."""
    if kind not in KINDS:
        raise InvalidInput(f"A run learns {' or '.join(KINDS)}, not {kind!r}.")
    if mode not in MODES:
        raise InvalidInput(f"A run's mode is {' or '.join(MODES)}, not {mode!r}.")
    return mode if kind == "performance" else kind


def _features(session: Session, project_id: str, shown: list[Demonstration]) -> str:
    """Name of the features that count in the project, on the demonstrated tools' set."""
    return project_features(session, project_id, found(session, Segmentation, shown[0].segmentation_id, "segmentation").feature_set).name


def _interest(session: Session, project_id: str, shown: list[Demonstration]) -> list[str]:
    """Segmentations of the other tools with the same features: what the weights are for, and what may be asked about."""
    trained = {d.tool_id for d in shown}
    features = found(session, Segmentation, shown[0].segmentation_id, "segmentation").feature_set
    cuts = [current_segmentation(session, tool.id) for tool in tools_of(session, project_id) if tool.id not in trained]
    return [cut.id for cut in cuts if cut is not None and cut.feature_set == features]


def _latest_policy(session: Session, project_id: str) -> PolicyRow:
    row = session.exec(select(PolicyRow).where(PolicyRow.project_id == project_id).order_by(col(PolicyRow.id).desc())).first()
    if row is None:
        raise InvalidInput(
            "Effort settles ties between orders that are equally good, so what is good comes first: teach your order, then compare."
        )
    return row


def _demonstrations(session: Session, project_id: str, base: PolicyRow | None, authors: list[str]) -> tuple[list[str], list[Demonstration]]:
    """The standing demonstrations of some experts that share one feature set, and the experts' names where there are several.

    An effort run that names nobody learns from those its policy was learned from.
    """
    if base and not authors:
        authors = found(session, Run, base.run_id, "run").authors
    names, orders = orders_by(standing(session, project_id), authors)
    shown = [(d, found(session, Segmentation, d.segmentation_id, "segmentation").feature_set) for d in orders]
    own = base_name(base.feature_set) if base else ANY_TOOL
    wanted = own if own != ANY_TOOL else next((features for _, features in shown), None)
    kept = [d for d, features in shown if features == wanted]
    if not kept:
        raise InvalidInput("There is no recorded order to learn from. Record one first.")
    return names, kept
