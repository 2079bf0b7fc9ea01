"""A file that is being asked about: how it stands, what a click on a body says, how bodies are marked."""

import asyncio

import numpy as np
import pytest

from app.errors import TooLarge
from app.geometry import preview as module
from app.geometry.importing import UP, rotation_to_up
from app.geometry.preview import preview
from app.viewer.file_nodes import body_colour, other_arrows
from app.viewer.palette import LIGHT, mixed, rgb
from app.viewer.picture import SELECTED_SHARE
from tests.viewer.fakes import CAMERA, FakeWorkflow, Served, click, connect, eventually, receive, two_boxes


@pytest.mark.parametrize(
    ("up", "size"), [("+z", (52 / 52, 20 / 52, 10 / 52)), ("-x", (20 / 52, 10 / 52, 52 / 52)), ("+y", (52 / 52, 10 / 52, 20 / 52))]
)
def test_it_stands_with_the_direction_up(up: str, size: tuple[float, float, float]) -> None:
    """The boxes together are 52 x 20 x 10; the longest side becomes one metre, the lowest point is on the floor."""
    shown = preview(two_boxes(), up)
    low, high = shown.mesh.vertices.min(0), shown.mesh.vertices.max(0)
    assert sorted((high - low)[:2]) == pytest.approx(sorted(size[:2]))
    assert (low[2], high[2]) == pytest.approx((0, size[2]))
    assert low[:2] + high[:2] == pytest.approx([0, 0])
    assert shown.names == ("plate", "pin")


def test_too_many_triangles_are_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "MOST_FACES", 23)
    with pytest.raises(TooLarge, match="24 triangles"):
        preview(two_boxes(), "+z")


@pytest.mark.parametrize("up", UP)
def test_arrows_point_where_the_directions_of_the_file_do(up: str) -> None:
    """Turned back into the file's frame each is its own direction; none begins inside the file's box."""
    low, high = np.array([-0.5, -0.2, 0.0]), np.array([0.5, 0.2, 0.3])
    arrows = other_arrows(low, high, up)
    assert set(arrows) == set(UP) - {up}
    for direction, (start, way) in arrows.items():
        unit = (1 if direction[0] == "+" else -1) * np.eye(3)["xyz".index(direction[1])]
        assert rotation_to_up(up).T @ way / np.linalg.norm(way) == pytest.approx(unit)
        assert ((start < low) | (start > high)).any()


def test_bodies_are_marked() -> None:
    first, second = (body_colour(k, "1", False, False) for k in (0, 1))
    assert first == rgb(LIGHT.region_tints[0])
    assert second == body_colour(2, "1", False, False), "what is left out is grey, whichever it is"
    assert body_colour(1, "all", False, False) == rgb(LIGHT.region_tints[1])
    assert body_colour(0, "1", True, False) == mixed(rgb(LIGHT.region_tints[0]), rgb(LIGHT.current), SELECTED_SHARE)


def test_a_click_on_a_body_is_told_and_a_tool_takes_its_place(served: Served, workflow: FakeWorkflow) -> None:
    async def main() -> None:
        workflow.show(mode="file", tool_id="t1", up="+z", body="1")
        async with connect(served.base) as socket:
            await socket.send(CAMERA)
            messages = await receive(socket, lambda seen: any(m.get("name") == "/file/up" for m in seen))
            assert {"/file/body0", "/file/body1"} <= {m.get("name") for m in messages}
            await socket.send(click(1).replace(b"\xaa/tool/r001", b"\xab/file/body1"))
            await eventually(lambda: workflow.picked == [("s1", 1)])
            assert {m["name"] for m in messages if m.get("name", "").startswith("/file/choice") and m["type"] == "MeshMessage"} == {
                f"/file/choice{d}" for d in ("+x", "-x", "+y", "-y", "-z")
            }
            await socket.send(click(1).replace(b"\xaa/tool/r001", b"\xae/file/choice-y"))
            await eventually(lambda: workflow.ups == [("s1", "-y")])
            workflow.show(mode="tool", tool_id="t1")
            await receive(socket, lambda seen: any(m.get("name") == "/tool/r000" for m in seen))
        view = served.hub._views["s1"]
        await eventually(lambda: view.stage.shown is not None and len(view.stage.shown.regions) == workflow.tool.n)

    asyncio.run(main())
