"""How long a move of the slider and the first piece under a click take: everything the server does for it, database and view included."""

import tempfile
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import trimesh

from app.benches.composites import Composite
from app.benches.figures import Figure
from app.geometry.creases import creased
from app.geometry.tool import Array
from app.settings import Settings
from app.viewer.borders import find_lines, part_of
from app.viewer.palette import tint_choice
from app.viewer.projection import label_points
from app.workflow import editing_views, projects, segmentations, tools
from app.workflow.context import Context, open_context

TARGETS = (3, 40, 6, 20, 10, 14)  # positions of the slider, one after the other
BAR = 0.3  # s


@dataclass(frozen=True)
class _Times:
    """Processor seconds."""

    ready: float  # what the editor does first
    free: Array  # (positions,)
    locked: Array  # (positions,) of one drag beside two locked regions
    piece: float  # the first reassign


def measure_slider(composite: Composite) -> Iterator[Figure]:
    """Cut, borders, attributes, adjacency, storing, region table and what the view draws, through the workflow's functions."""
    size = f"{round(len(composite.mesh.faces), -3) // 1000}k"
    one, other = _drags(composite), _drags(composite)  # a moment of a busy machine is outlasted
    ready, piece = min(one.ready, other.ready), min(one.piece, other.piece)
    free, locked = np.minimum(one.free, other.free), np.minimum(one.locked, other.locked)
    yield Figure("slider", f"getting ready, {composite.name}, {size}", ready, "s", note="once, in the background, when the editor opens")
    note = "slowest of 6 positions, 3 to 40 regions; processor time, best of two"
    yield Figure("slider", f"slider_whole_answer_{size}, {composite.name}", float(free.max()), "s", BAR, note=note)
    yield Figure("slider", f"mean of these, {composite.name}, {size}", float(free.mean()), "s")
    note = "one drag beside two locked regions, slowest of 6 positions"
    yield Figure("slider", f"slider_locked_{size}, {composite.name}", float(locked.max()), "s", BAR, note=note)
    yield Figure("slider", f"first reassign after it, {composite.name}, {size}", piece, "s", note="finding the piece, moving it, storing")


def _drags(composite: Composite) -> _Times:
    """On a server of its own, so that nothing is known beforehand."""
    with tempfile.TemporaryDirectory(prefix="apprentice-bench-") as name:
        folder = Path(name)
        ctx = open_context(Settings(data=folder / "data", executor="inline"))
        try:
            tool_id = _tool(ctx, composite, folder / "part.stl")
            ready = _seconds(lambda: editing_views.get_ready(ctx, tool_id))
            free = [_seconds(lambda n=n: _answer(ctx, tool_id, n)) for n in TARGETS]
            segmentations.edit_tool(ctx, tool_id, {"kind": "lock", "regions": [0, 3], "on": True})
            locked = [_seconds(lambda n=n: _answer(ctx, tool_id, n, continues=n != TARGETS[0])) for n in TARGETS]
            segmentations.edit_tool(ctx, tool_id, {"kind": "lock", "regions": [0, 1], "on": False})
            return _Times(ready, np.array(free), np.array(locked), _seconds(lambda: _reassign(ctx, tool_id)))
        finally:
            ctx.close()


def _tool(ctx: Context, composite: Composite, path: Path) -> str:
    """The composite uploaded as anybody would."""
    trimesh.Trimesh(composite.mesh.vertices * 1e3, composite.mesh.faces, process=False).export(path)
    project = projects.create_project(ctx, "Bench")["id"]
    tool = tools.upload_tool(ctx, project, path, path.name, units="mm", up="+z")
    ctx.jobs.wait_idle(300)
    return tool["id"]


def _answer(ctx: Context, tool_id: str, regions: int, *, continues: bool = False) -> None:
    segmentations.recut_tool(ctx, tool_id, {"target": regions}, continues=continues)
    segmentations.list_regions(ctx, tool_id)
    tool = tools.tool_value(ctx, tool_id)
    find_lines(tool, 1e-3)
    sharp = creased(tool.mesh, tool.labels)
    for region in range(-1, tool.n):
        part_of(sharp, sharp.faces[tool.labels == region])
    label_points(tool)
    tint_choice(tool.graph.neighbour)


def _reassign(ctx: Context, tool_id: str) -> None:
    tool = tools.tool_value(ctx, tool_id)
    largest = max(range(tool.n), key=lambda a: tool.regions[a].area)
    inside = tool.mesh.faces[tool.labels == largest]
    point = tool.mesh.vertices[inside[len(inside) // 2]].mean(axis=0) * 1e3
    segmentations.edit_tool(ctx, tool_id, {"kind": "reassign", "point_mm": point.tolist(), "level": 1, "to": "new"})


def _seconds(work: Callable[[], object]) -> float:
    start = time.process_time()
    work()
    return time.process_time() - start
