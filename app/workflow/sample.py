"""The sample project: parametric moulds, a scripted expert's orders for most of those meant for training, one left to record.

The expert works by known weights, so everything learned from the project can be compared with the truth.
"""

import numpy as np
from sqlmodel import Session

from app.geometry.moulds import Mould, sample_moulds
from app.geometry.regions import measure
from app.geometry.tool import Tool
from app.learning.effort_features import EFFORT_COLUMNS
from app.learning.expert import ScriptedExpert
from app.sequencing.features import DEFAULT_INTERACTIONS, feature_set_for
from app.sequencing.problem import SequencingProblem
from app.storage import emit
from app.storage.conversions import tool_to_bytes
from app.storage.tables import Demonstration, ToolRow
from app.workflow.context import Context
from app.workflow.tool_rows import add_cut

AUTHOR = "Scripted expert"
LEFT_TO_RECORD = 1  # training moulds at the end of the list that get no demonstration
# Cost per feature of the scripted expert: stepping down, open borders and open opposite sides are worst. Far enough from where
# learning starts that it has to ask a few questions.
WEIGHTS = {
    "borders_unfinished": 1.0,
    "borders_finished": 0.02,
    "opposite_unfinished": 1.0,
    "opposite_finished": 0.02,
    "jump": 0.05,
    "gaps_inside": 0.02,
    "gaps_left": 0.02,
    "curvature": 0.5,
    "orientation": 0.02,
    "height_up": 0.02,
    "height_down": 2.0,
    "height*curvature": 0.02,
    "orientation*curvature": 0.02,
}
EFFORT = {"start_right": 1.0, "start_back": 0.4}  # the expert stands at the left front corner; where work ends costs nothing


def scripted_expert(problem: SequencingProblem) -> ScriptedExpert:
    """The expert whose orders the sample project holds."""
    effort = np.array([EFFORT.get(key, 0.0) for key, _ in EFFORT_COLUMNS])
    return ScriptedExpert(np.array([WEIGHTS[column.key] for column in problem.columns]), effort)


def create_sample(ctx: Context, project_id: str) -> None:
    """Fill a new project."""
    moulds = sample_moulds()
    train = [mould.name for mould in moulds if mould.split == "train"]
    shown = train[: len(train) - LEFT_TO_RECORD]
    made: list[tuple[Mould, Tool, tuple[int, ...] | None]] = []
    for mould in moulds:
        tool = measure(mould.mesh, mould.labels)
        sequence = None
        if mould.name in shown:
            problem = SequencingProblem(tool.graph, feature_set_for(tool.graph), DEFAULT_INTERACTIONS)
            sequence = scripted_expert(problem).sequence(problem)
        made.append((mould, tool, sequence))

    def change(session: Session) -> None:
        for mould, tool, sequence in made:
            _add(ctx, session, project_id, mould, tool, sequence)
        emit(session, "coverage.changed", project_id)
        emit(session, "project.changed", project_id)

    ctx.store.write(change)


def _add(ctx: Context, session: Session, project_id: str, mould: Mould, tool: Tool, sequence: tuple[int, ...] | None) -> None:
    row = ToolRow(project_id=project_id, name=mould.name, kind="sample", state="ready", split=mould.split, report=[])
    session.add(row)
    session.flush()
    cut = add_cut(session, ctx.store, row, tool_to_bytes(tool), tool.n, feature_set_for(tool.graph).name, {})
    if sequence is not None:
        demonstration = Demonstration(
            project_id=project_id,
            tool_id=row.id,
            segmentation_id=cut.id,
            name=mould.name,
            sequence=list(sequence),
            source="scripted",
            author=AUTHOR,
        )
        session.add(demonstration)
        session.flush()
    emit(session, "tool.changed", project_id, tool_id=row.id)
