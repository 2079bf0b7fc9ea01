"""What an upload asks, what answers lead to, and how each answer can be changed later."""

from pathlib import Path

import pytest

from app.errors import InvalidInput
from app.workflow import projects, segmentations, tools
from app.workflow.context import Context
from tests.geometry.cad_files import exported, glb, step

TWO = (("base plate", 1.0), ("clamp", 0.5))


@pytest.fixture
def project(ctx: Context) -> str:
    return projects.create_project(ctx, "Parts")["id"]


def saved(folder: Path, content: bytes) -> Path:
    path = folder / "stored"
    path.write_bytes(content)
    return path


def test_units_come_with_sizes_and_a_hint_where_they_are_unlikely(ctx: Context, project: str, tmp_path: Path) -> None:
    questions = tools.upload_tool(ctx, project, saved(tmp_path, exported("stl")), "bump.stl")["questions"]
    assert questions["units"]["sizes"] == [
        {"unit": "mm", "size": "60 × 40 × 25 mm", "hint": None},
        {"unit": "cm", "size": "600 × 400 × 250 mm", "hint": None},
        {"unit": "m", "size": "60 × 40 × 25 m", "hint": "this would make the part 60 m long"},
        {"unit": "in", "size": "1.524 × 1.016 × 0.635 m", "hint": None},
    ]
    assert questions["body"] is None


def test_a_file_that_knows_its_size_is_not_asked_for_it(ctx: Context, project: str, tmp_path: Path) -> None:
    tool = tools.upload_tool(ctx, project, saved(tmp_path, step()), "part.step")
    assert (tool["units"], tool["questions"]["units"], tool["questions"]["body"]) == ("m", None, None)
    assert [body["name"] for body in tool["bodies"]] == ["bracket"]


def test_the_body_is_asked_and_can_be_changed(ctx: Context, project: str, tmp_path: Path) -> None:
    """Largest first, "all" at the end; nothing is read before an answer; a later answer reads anew and keeps the old cut."""
    tool = tools.upload_tool(ctx, project, saved(tmp_path, glb(TWO)), "fixture.glb", up="+z")
    body = tool["questions"]["body"]
    assert (tool["state"], body["guess"]) == ("asking", "1")
    assert [(c["id"], c["name"], c["faces"], c["size"]) for c in body["choices"]] == [
        ("1", "base plate", 14, "60 × 40 × 25 mm"),
        ("2", "clamp", 14, "30 × 20 × 12.5 mm"),
        ("all", "All 2 bodies", 28, "230 × 40 × 25 mm"),
    ]
    with pytest.raises(InvalidInput, match="has 2 bodies; there is no body 3"):
        tools.answer_tool(ctx, tool["id"], {"body": "3"}, tool["version"])
    areas = {}
    for choice in ("2", "1", "all"):
        tool = tools.answer_tool(ctx, tool["id"], {"body": choice}, tools.get_tool(ctx, tool["id"])["version"])
        assert tool["state"] == "importing"
        assert ctx.jobs.wait_idle(60)
        ready = tools.get_tool(ctx, tool["id"])
        assert (ready["state"], ready["body"], ready["questions"]) == ("ready", choice, None)
        areas[choice] = sum(region["area_mm2"] for region in segmentations.list_regions(ctx, tool["id"]))
    assert areas["1"] == pytest.approx(4 * areas["2"])
    assert areas["all"] == pytest.approx(areas["1"] + areas["2"])


def test_everything_said_at_once_asks_nothing(ctx: Context, project: str, tmp_path: Path) -> None:
    tool = tools.upload_tool(ctx, project, saved(tmp_path, glb(TWO)), "fixture.glb", up="+z", body="all")
    assert (tool["state"], tool["body"]) == ("importing", "all")
    with pytest.raises(InvalidInput, match=r"There is no body '7' in the file\. Choose 1 to 2, or all"):
        tools.upload_tool(ctx, project, saved(tmp_path, glb(TWO)), "fixture.glb", up="+z", body="7")


def test_the_report_is_graded(ctx: Context, project: str, tmp_path: Path) -> None:
    tool = tools.upload_tool(ctx, project, saved(tmp_path, glb(TWO)), "fixture.glb", up="+z", body="2")
    assert ctx.jobs.wait_idle(60)
    report = {(line["level"], line["text"]) for line in tools.get_tool(ctx, tool["id"])["report"]}
    assert ("refused", "Left out all bodies but clamp, one of 2 (80.0 % of the area).") in report
    assert ("info", "The surface is closed.") in report
