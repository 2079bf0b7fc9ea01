"""Adding parts: what is asked, what is refused, what an import leaves behind."""

import io
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh

from app.errors import Conflict, InvalidInput, NotFound, StaleVersion, UnreadableMesh
from app.geometry.moulds import sample_moulds
from app.workflow import projects, record, segmentations, tools
from app.workflow.context import Context
from tests.workflow.conftest import project_of


@pytest.fixture
def project(ctx: Context) -> str:
    return projects.create_project(ctx, "Parts")["id"]


@pytest.fixture
def part(tmp_path: Path) -> Path:
    """A sample mould as STL in millimetres."""
    mesh = sample_moulds()[0].mesh
    path = tmp_path / "stored"
    path.write_bytes(trimesh.Trimesh(mesh.vertices * 1000, mesh.faces, process=False).export(file_type="stl"))
    return path


def test_a_file_without_units_is_asked_about_and_read_once_answered(ctx: Context, project: str, part: Path) -> None:
    tool = tools.upload_tool(ctx, project, part, "Bend.stl")
    assert (tool["name"], tool["state"], tool["region_count"]) == ("Bend", "asking", None)
    assert tool["questions"]["units"]["guess"] == "mm"
    assert tool["questions"]["up"]["guess"] == "+z"
    with pytest.raises(Conflict, match="not read in yet"):
        segmentations.list_regions(ctx, tool["id"])
    assert projects.get_project(ctx, project)["next_step"]["title"] == "Set up Bend"
    half = tools.answer_tool(ctx, tool["id"], {"units": "mm"}, tool["version"])
    assert (half["state"], half["questions"]["units"]) == ("asking", None)
    with pytest.raises(StaleVersion):
        tools.answer_tool(ctx, tool["id"], {"up": "+z"}, tool["version"])
    whole = tools.answer_tool(ctx, tool["id"], {"up": "+z"}, half["version"])
    assert (whole["state"], whole["questions"]) == ("importing", None)
    assert whole["job"] is not None
    assert ctx.jobs.wait_idle(60)
    ready = tools.get_tool(ctx, tool["id"])
    assert (ready["state"], ready["feature_set"], ready["job"]) == ("ready", "clean", None)
    regions = segmentations.list_regions(ctx, tool["id"])
    assert len(regions) == ready["region_count"] >= 2
    assert all(b in range(len(regions)) and r["id"] in regions[b]["neighbours"] for r in regions for b in r["neighbours"])
    scene = trimesh.load(io.BytesIO(tools.mesh_glb(ctx, tool["id"])), file_type="glb")
    assert set(scene.graph.nodes_geometry) == {"body", *(f"region_{a}" for a in range(len(regions)))}
    assert scene.extents == pytest.approx(np.ptp(sample_moulds()[0].mesh.vertices, axis=0), abs=1e-6)  # metres again


def test_a_new_cut_leaves_the_old_demonstration_alone(ctx: Context, project: str, part: Path) -> None:
    tool = tools.upload_tool(ctx, project, part, "Bend.stl", units="mm", up="+z")
    assert ctx.jobs.wait_idle(60)
    tool = tools.get_tool(ctx, tool["id"])
    n = tool["region_count"]
    shown = record.create_demonstration(ctx, tool["id"], list(range(n)))
    assert tools.segment_tool(ctx, tool["id"], {"target": 3})["state"] == "importing"
    assert ctx.jobs.wait_idle(60)
    cut = tools.get_tool(ctx, tool["id"])
    assert (cut["state"], cut["region_count"], cut["demonstrated"]) == ("ready", 3, False)
    assert cut["segmentation_id"] != shown["segmentation_id"]
    assert tools.segmentation_value(ctx, shown["segmentation_id"]).n == n
    assert record.get_demonstration(ctx, shown["id"])["sequence"] == list(range(n))


def test_what_cannot_be_read_leaves_nothing(ctx: Context, project: str, tmp_path: Path) -> None:
    broken = tmp_path / "broken"
    broken.write_bytes(b"")
    with pytest.raises(UnreadableMesh, match="empty"):
        tools.upload_tool(ctx, project, broken, "broken.stl")
    with pytest.raises(NotFound):
        tools.upload_tool(ctx, "nowhere", broken, "broken.stl")
    assert tools.list_tools(ctx, project) == []
    assert [p for p in ctx.settings.artifacts.rglob("*") if p.is_file()] == []


def test_deleting_while_it_is_read_drops_the_result_and_restoring_reads_again(ctx: Context, project: str, part: Path) -> None:
    ctx.jobs.close()  # nobody works yet
    tool = tools.upload_tool(ctx, project, part, "Bend.stl", units="mm", up="+z")
    tools.delete_tool(ctx, tool["id"], tool["version"])
    ctx.jobs.start()
    assert ctx.jobs.wait_idle(60)
    assert tools.list_tools(ctx, project) == []
    assert tools.restore_tool(ctx, tool["id"])["state"] == "importing"
    assert ctx.jobs.wait_idle(60)
    assert tools.get_tool(ctx, tool["id"])["state"] == "ready"


def test_tools_that_come_with_regions_are_not_cut(sample: Context) -> None:
    tool: dict[str, Any] = tools.list_tools(sample, project_of(sample)["id"])[0]
    with pytest.raises(InvalidInput, match="comes with its regions"):
        tools.segment_tool(sample, tool["id"], {})
    with pytest.raises(InvalidInput, match="no units"):
        tools.answer_tool(sample, tool["id"], {"units": "mm"}, tool["version"])
