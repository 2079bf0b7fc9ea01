"""Recording a demonstration, as clicks, keys and REST do it."""

from typing import Any

import pytest

from app.errors import IncompleteSequence, InvalidInput, NotFound, StaleVersion
from app.workflow import coverage, record, segmentations, sessions, tools
from app.workflow.context import Context
from tests.workflow.conftest import project_of


@pytest.fixture
def tool(sample: Context) -> dict[str, Any]:
    """The training tool nobody has shown yet."""
    (left,) = [t for t in tools.list_tools(sample, project_of(sample)["id"]) if t["split"] == "train" and not t["demonstrated"]]
    assert project_of(sample)["next_step"]["tool_id"] == left["id"]
    return left


def test_clicks_undo_redo_clear(sample: Context, tool: dict[str, Any]) -> None:
    key = tool["id"]
    view = sessions.create_session(sample, tool["project_id"])
    sessions.show(sample, view["id"], {"mode": "record", "tool_id": key})
    for region in (4, 2, 7):
        sessions.pick_in_view(sample, view["id"], region)
    assert record.get_draft(sample, key)["sequence"] == [4, 2, 7]
    with pytest.raises(IncompleteSequence, match="number 2 already"):
        sessions.pick_in_view(sample, view["id"], 2)
    with pytest.raises(InvalidInput, match="no region 99"):
        sessions.pick_in_view(sample, view["id"], 99)
    sessions.command_in_view(sample, view["id"], "undo")
    sessions.command_in_view(sample, view["id"], "undo")
    draft = record.get_draft(sample, key)
    assert (draft["sequence"], draft["can_undo"], draft["can_redo"]) == ([4], True, True)
    assert record.redo(sample, key)["sequence"] == [4, 2]
    assert record.pick(sample, key, 0)["can_redo"] is False
    assert record.clear(sample, key)["sequence"] == []
    assert record.undo(sample, key)["sequence"] == [4, 2, 0]
    assert record.place(sample, key, [0, 4, 2])["sequence"] == [0, 4, 2]
    assert record.undo(sample, key)["sequence"] == [4, 2, 0]


def test_an_incomplete_order_names_what_is_missing(sample: Context, tool: dict[str, Any]) -> None:
    record.place(sample, tool["id"], list(range(tool["region_count"] - 2)))
    with pytest.raises(IncompleteSequence, match="K, L have no number yet"):
        record.save(sample, tool["id"])


def test_saving_counts_and_supersedes(sample: Context, tool: dict[str, Any]) -> None:
    key, n = tool["id"], tool["region_count"]
    before = coverage.get_coverage(sample, tool["project_id"])
    draft = record.place(sample, key, list(range(n)))
    assert draft["complete"] is True
    first = record.save(sample, key, "First")
    after = coverage.get_coverage(sample, tool["project_id"])
    assert draft["coverage_gain"]["before"] == before["rho"]
    assert draft["coverage_gain"]["after"] == after["rho"]
    assert (after["demonstrations"], after["steps"]) == (before["demonstrations"] + 1, before["steps"] + n)
    assert record.get_draft(sample, key)["sequence"] == []
    second = record.create_demonstration(sample, key, list(range(n))[::-1], "Second")
    assert record.get_demonstration(sample, first["id"])["superseded_by"] == second["id"]
    assert tools.get_tool(sample, key)["demonstration_id"] == second["id"]


def test_deleting_can_be_undone(sample: Context, tool: dict[str, Any]) -> None:
    shown = record.create_demonstration(sample, tool["id"], list(range(tool["region_count"])))
    renamed = record.update_demonstration(sample, shown["id"], {"name": "Mine"}, shown["version"])
    with pytest.raises(StaleVersion):
        record.delete_demonstration(sample, shown["id"], shown["version"])
    record.delete_demonstration(sample, shown["id"], renamed["version"])
    assert tools.get_tool(sample, tool["id"])["demonstrated"] is False
    with pytest.raises(NotFound, match="deleted"):
        record.get_demonstration(sample, shown["id"])
    again = record.create_demonstration(sample, tool["id"], list(range(tool["region_count"]))[::-1])
    assert record.restore_demonstration(sample, shown["id"])["name"] == "Mine"
    assert tools.get_tool(sample, tool["id"])["demonstration_id"] == shown["id"]
    assert record.get_demonstration(sample, again["id"])["superseded_by"] == shown["id"]


def test_a_region_keeps_its_given_name(sample: Context, tool: dict[str, Any]) -> None:
    assert segmentations.rename_region(sample, tool["id"], 0, " Lip ")["name"] == "Lip"
    assert tools.tool_value(sample, tool["id"]).regions[0].name == "Lip"
    with pytest.raises(InvalidInput, match="name of its own"):
        segmentations.rename_region(sample, tool["id"], 1, "Lip")


def test_a_click_in_a_view_that_shows_is_told_to_the_page(sample: Context, tool: dict[str, Any]) -> None:
    view = sessions.create_session(sample, tool["project_id"])
    sessions.show(sample, view["id"], {"mode": "tool", "tool_id": tool["id"]})
    sessions.pick_in_view(sample, view["id"], 3)
    last = sample.store.events_after(0, tool["project_id"])[-1]
    assert (last.type, last.data) == ("session.picked", {"session_id": view["id"], "region": 3})
    assert record.get_draft(sample, tool["id"])["sequence"] == []
    with pytest.raises(InvalidInput, match="records an order"):
        sessions.command_in_view(sample, view["id"], "undo")
