"""A view in which regions are edited: what clicks, boxes and the pointer mean, and what is drawn."""

import asyncio
from typing import Any

import httpx
import msgspec
import numpy as np
import pytest

from app.geometry import editing
from app.geometry.line_cut import draw_line
from app.viewer.marks import marks_of
from app.viewer.palette import LIGHT, mixed, rgb
from app.viewer.picture import SELECTED_SHARE, Progress, paint
from app.viewer.projection import camera_for, label_points, project
from app.viewer.rays import first_hit, ray_through, regions_in_box
from tests.viewer.fakes import FakeWorkflow, Served, connect, eventually, sample_tool

EDIT: dict[str, Any] = {
    "mode": "edit", "tool_id": "t1", "pointing": "select", "selection": [], "points": [], "level": 1, "path": None, "closed": False,
}  # fmt: skip


def test_ray_through_the_place_of_a_point_hits_it() -> None:
    """`ray_through` is the inverse of `project`: the ray through each label's pixel meets its region there."""
    tool, aspect = sample_tool(), 1.25
    camera = camera_for(tool)
    for region, point in enumerate(label_points(tool)):
        x, y = project(point[None], camera, aspect, 1.0)[0] / [aspect, 1.0]
        origin, direction = ray_through(camera, x, y, aspect)
        assert np.linalg.norm(np.cross(direction, point - origin)) < 1e-9
        hit = first_hit(tool.mesh, origin, direction, tool.labels == region)
        assert hit is not None
        assert np.allclose(hit[1], point, atol=1e-9)
        assert tool.labels[hit[0]] == region
    assert first_hit(tool.mesh, camera.position, -direction) is None


def test_box_takes_what_is_seen_in_it() -> None:
    tool, aspect = sample_tool(), 1.0
    camera = camera_for(tool)
    assert regions_in_box(tool, camera, aspect, (0, 0), (1, 1)) == list(range(tool.n))
    place = project(label_points(tool), camera, aspect, 1.0)
    left = regions_in_box(tool, camera, aspect, (0, 0), (0.5, 1))
    assert 0 < len(left) < tool.n
    assert place[left, 0].mean() < place[[r for r in range(tool.n) if r not in left], 0].mean()
    assert regions_in_box(tool, camera, aspect, (0, 0), (0.02, 0.02)) == []


def test_looks_of_regions_being_edited() -> None:
    progress = Progress(selected=frozenset({0}), hover=1, locked=frozenset({2}), hidden=frozenset({3}))
    a, b, c, d = paint(progress, "ABCD", (0, 1, 2, 3), dark=False).regions
    assert (a.outline, b.outline, c.outline) == ("selected", "hover", None)
    assert a.colour == mixed(rgb(LIGHT.region_tints[0]), rgb(LIGHT.current), SELECTED_SHARE)
    assert b.colour == rgb(LIGHT.region_tints[1])
    assert (c.text, c.colour) == ("C locked", rgb(LIGHT.body))
    assert [r.visible for r in (a, b, c, d)] == [True, True, True, False]


def test_line_and_plane_are_drawn_before_they_cut() -> None:
    tool = sample_tool()
    corners = tool.mesh.vertices[tool.mesh.faces[tool.labels == 0]].mean(axis=1)
    ends = corners[[int(np.argmin(corners[:, 0])), int(np.argmax(corners[:, 0]))]]
    clicked = [{"point_mm": (p * 1e3).tolist(), "region": 0} for p in ends]
    line = marks_of(tool, {**EDIT, "pointing": "points", "path": "line", "points": clicked}, None)
    length = np.linalg.norm(np.diff(line.line, axis=1), axis=2).sum()
    drawn = draw_line(tool, 0, ends).points
    assert length == pytest.approx(np.linalg.norm(np.diff(drawn, axis=0), axis=1).sum())
    plane = marks_of(tool, {**EDIT, "pointing": "points", "path": "plane", "points": clicked}, None)
    normal = editing.upright_plane(tool, 0, *ends)
    assert len(plane.line) > 0
    assert np.abs((plane.line - ends[0]) @ normal).max() < 1e-9 * np.linalg.norm(normal)
    piece = marks_of(tool, {**EDIT, "pointing": "piece", "points": clicked[:1]}, tool.labels == 3)
    assert len(piece.line) > 0
    assert len(piece.points) == 1
    wrong = [clicked[0], {"point_mm": [9e3, 9e3, 9e3], "region": 0}]
    assert "doesn't lie on" in (marks_of(tool, {**EDIT, "pointing": "points", "path": "line", "points": wrong}, None).trouble or "")


def message(type: str, **values: Any) -> bytes:
    return msgspec.msgpack.encode({"type": type, **values})


def test_clicks_boxes_and_the_pointer_reach_the_workflow(served: Served, workflow: FakeWorkflow) -> None:
    """A click carries the place on the part in millimetres; a miss selects nothing; a box adds; the pointer is answered."""
    workflow.scene = dict(EDIT)
    camera, target = camera_for(workflow.tool), label_points(workflow.tool)[5]
    way = target - camera.position
    way /= np.linalg.norm(way)
    seen = {
        "wxyz": [1, 0, 0, 0], "position": camera.position.tolist(), "fov": camera.fov, "near": 0.01, "far": 1000.0, "image_height": 500,
        "image_width": 500, "look_at": camera.look_at.tolist(), "up_direction": [0, 0, 1],
    }  # fmt: skip

    async def main() -> None:
        async with connect(served.base) as socket:
            view = served.hub._views["s1"]
            await socket.send(message("ViewerCameraMessage", **seen))
            await eventually(lambda: view.server.get_clients())
            ray = {"ray_origin": camera.position.tolist(), "ray_direction": way.tolist()}
            click = {"name": "/tool/r005", "instance_index": None, **ray, "screen_pos": [0.5, 0.5], "owner": ""}
            await socket.send(message("SceneNodeClickMessage", **click, modifier=None))
            await eventually(lambda: len(workflow.points) == 1)
            region, point, modifier = workflow.points[0]
            assert (region, modifier) == (5, False)
            assert np.allclose(point, target * 1e3, atol=1e-3)
            await asyncio.sleep(0.06)  # viser takes one click per node in 50 ms
            await socket.send(message("SceneNodeClickMessage", **click, modifier="shift"))
            await eventually(lambda: len(workflow.points) == 2)
            assert workflow.points[1][2] is True
            miss = {"event_type": "click", "screen_pos": [[0.5, 0.5]], "modifier": None, "ray_origin": camera.position.tolist()}
            await socket.send(message("ScenePointerMessage", **miss, ray_direction=way.tolist()))  # hits the part: no miss
            await socket.send(message("ScenePointerMessage", **miss, ray_direction=(-way).tolist()))
            await eventually(lambda: len(workflow.points) == 3)
            assert workflow.points[2] == (None, None, False)
            box = {
                "event_type": "rect-select",
                "ray_origin": None,
                "ray_direction": None,
                "screen_pos": [[0, 0], [1, 1]],
                "modifier": "shift",
            }
            await socket.send(message("ScenePointerMessage", **box))
            await eventually(lambda: workflow.scene["selection"] == list(range(workflow.tool.n)))
            x, y = (project(target[None], camera, 1.0, 1.0)[0]).tolist()
            async with httpx.AsyncClient() as browser:
                answer = (await browser.post(f"{served.base}/v/s1/under", json={"x": x, "y": y})).json()
                assert answer["region"] == 5
                assert np.allclose(answer["point_mm"], target * 1e3, atol=1e-3)
                nothing = (await browser.post(f"{served.base}/v/s1/under", json={"x": None, "y": None})).json()
                assert nothing == {"region": None, "on_body": False, "point_mm": None}
                assert (await browser.post(f"{served.base}/v/s1/under", json={"x": 7, "y": 0})).status_code == 422
            assert workflow.ready == ["t1"], "prepared once, before the first edit"
            workflow.state["hidden"] = [5]
            workflow.tell("tool.changed", tool_id="t1")
            await eventually(lambda: view.stage.shown is not None and not view.stage.shown.regions[5].visible)

    asyncio.run(main())
