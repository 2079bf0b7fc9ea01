"""Any series of edits can be undone and done again bit for bit; two people editing at once don't overwrite each other."""

from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from app.errors import AppError, Conflict, InvalidInput, StaleVersion
from app.geometry.tool import Tool
from app.storage.conversions import tool_to_bytes
from app.workflow import segmentations, tools
from app.workflow.context import Context
from tests.workflow.conftest import project_of


def sample_id(ctx: Context) -> str:
    return tools.list_tools(ctx, project_of(ctx)["id"])[0]["id"]


def random_edit(tool: Tool, rng: np.random.Generator) -> dict[str, Any]:
    """Something a person could click, sensible or not."""
    a, other = (int(x) for x in rng.integers(tool.n, size=2))
    inside = np.flatnonzero(tool.labels == a)
    corners = tool.mesh.vertices[tool.mesh.faces[rng.choice(inside, 3)]]
    points = (np.einsum("kc,kci->ki", rng.dirichlet(np.ones(3), 3), corners) * 1e3).tolist()
    beside = np.flatnonzero(tool.graph.neighbour[a])
    edits: list[dict[str, Any]] = [
        {"kind": "merge", "regions": [a, int(rng.choice(beside)) if len(beside) else other]},
        {"kind": "split_plane", "region": a, "points_mm": points[:2]},
        {"kind": "split_grid", "regions": [a], "rows": 2, "columns": int(rng.integers(1, 3))},
        {"kind": "cut", "region": a, "path_mm": points[:2]},
        {"kind": "reassign", "point_mm": points[0], "level": int(rng.integers(1, 4)), "to": None if rng.random() < 0.5 else "new"},
        {"kind": "working", "on": False, "regions": [a]},
        {"kind": "lock", "regions": [other], "on": bool(rng.random() < 0.5)},
        {"kind": "hide", "regions": [other], "on": bool(rng.random() < 0.5)},
        {"kind": "rename", "region": a, "name": f"Name {rng.integers(1000)}"},
    ]
    return edits[int(rng.integers(len(edits)))]


def whole(ctx: Context, tool_id: str) -> tuple[bytes, list[Any], list[Any]]:
    """Everything about the regions, to the bit."""
    row = tools.get_tool(ctx, tool_id)
    return tool_to_bytes(tools.tool_value(ctx, tool_id)), row["edit"]["locked"], row["edit"]["hidden"]


@settings(max_examples=6, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.integers(0, 2**31))
def test_undo_and_redo_restore_bit_for_bit(sample: Context, seed: int) -> None:
    rng, tool_id = np.random.default_rng(seed), sample_id(sample)
    while tools.get_tool(sample, tool_id)["edit"]["can_undo"]:
        segmentations.undo(sample, tool_id)
    states = [whole(sample, tool_id)]
    for _ in range(6):
        tool = tools.tool_value(sample, tool_id)
        try:
            segmentations.edit_tool(sample, tool_id, random_edit(tool, rng))
        except InvalidInput:
            assert whole(sample, tool_id) == states[-1], "a refused edit changes nothing"
            continue
        states.append(whole(sample, tool_id))
    assert len(states) == 1 + tools.get_tool(sample, tool_id)["edit"]["step"]
    for state in states[-2::-1]:
        segmentations.undo(sample, tool_id)
        assert whole(sample, tool_id) == state
    with pytest.raises(Conflict, match="Nothing to undo"):
        segmentations.undo(sample, tool_id)
    for state in states[1:]:
        segmentations.redo(sample, tool_id)
        assert whole(sample, tool_id) == state


def test_of_two_edits_at_once_one_is_refused(sample: Context) -> None:
    tool_id = sample_id(sample)
    at = tools.get_tool(sample, tool_id)["segmentation_id"]
    edits = [{"kind": "split_grid", "regions": [region], "rows": 2, "columns": 2} for region in (0, 1)]

    def attempt(edit: dict[str, Any]) -> Any:
        try:
            return segmentations.edit_tool(sample, tool_id, edit, at)["region_count"]
        except AppError as error:
            return type(error)

    with ThreadPoolExecutor(2) as pool:
        outcomes = list(pool.map(attempt, edits))
    assert outcomes.count(StaleVersion) == 1
    assert tools.get_tool(sample, tool_id)["region_count"] == 15
