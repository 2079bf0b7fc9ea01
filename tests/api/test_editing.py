"""Editing regions by REST alone: every kind of edit, undo and redo over a restart, locks, orders carried over, views that follow."""

import csv
import io
import math
from typing import Any

import pytest
import trimesh

from app.main import create_app
from app.settings import Settings
from tests.api.problems import check_problem
from tests.conftest import Api


@pytest.fixture
def tool(api: Api) -> dict[str, Any]:
    """A sample tool with a demonstration."""
    project = api.post("/projects/sample")
    return next(t for t in api.get(f"/projects/{project['id']}/tools")["items"] if t["demonstrated"])


def regions(api: Api, tool: dict[str, Any]) -> list[dict[str, Any]]:
    return api.get(f"/tools/{tool['id']}/regions")["items"]


def edit(api: Api, tool: dict[str, Any], status: int = 201, **fields: Any) -> dict[str, Any]:
    return api.post(f"/tools/{tool['id']}/segmentations", {"edit": fields}, status)


def history(api: Api, tool: dict[str, Any]) -> list[dict[str, Any]]:
    return api.get(f"/tools/{tool['id']}/segmentations")["items"]


def ends_of(api: Api, tool: dict[str, Any], region: int) -> list[list[float]]:
    """Two points on a region, the middles of its borders to two neighbours or so: its centroid and that of a neighbour halfway."""
    rows = regions(api, tool)
    here = rows[region]["centroid_mm"]
    return [
        [(a + 0.5 * (b - a)) if k < 2 else a for k, (a, b) in enumerate(zip(here, rows[n]["centroid_mm"], strict=True))]
        for n in rows[region]["neighbours"][:2]
    ]


def test_merge_undo_redo_and_history(api: Api, tool: dict[str, Any]) -> None:
    before = regions(api, tool)
    other = before[0]["neighbours"][0]
    edited = edit(api, tool, kind="merge", regions=[0, other])
    names = {before[0]["name"], before[other]["name"]}
    assert edited["region_count"] == len(before) - 1
    assert edited["edit"]["undo"].startswith("Merged A and ")
    assert edited["demonstrated"] is False, "the order was clicked on other regions"
    after = regions(api, tool)
    assert names - {r["name"] for r in after}, "one of the two names is gone"
    assert {r["name"] for r in before} - names <= {r["name"] for r in after}, "the others keep theirs"
    undone = api.post(f"/tools/{tool['id']}/segmentations/undo", status=200)
    assert regions(api, tool) == before
    assert undone["segmentation_id"] == tool["segmentation_id"]
    assert undone["demonstrated"] is True
    assert (undone["edit"]["can_undo"], undone["edit"]["can_redo"]) == (False, True)
    redone = api.post(f"/tools/{tool['id']}/segmentations/redo", status=200)
    assert redone["segmentation_id"] == edited["segmentation_id"]
    assert regions(api, tool) == after
    steps = history(api, tool)
    assert [s["current"] for s in steps] == [False, True]
    assert [s["demonstrations"] for s in steps] == [1, 0]
    api.post(f"/tools/{tool['id']}/segmentations/redo", status=409)


def test_an_edit_after_an_undo_starts_a_branch_that_can_be_gone_back_to(api: Api, tool: dict[str, Any]) -> None:
    first = edit(api, tool, kind="merge", regions=[0, regions(api, tool)[0]["neighbours"][0]])
    api.post(f"/tools/{tool['id']}/segmentations/undo", status=200)
    edit(api, tool, kind="lock", regions=[1], on=True)
    api.post(f"/tools/{tool['id']}/segmentations/redo", status=409)
    assert [(s["current"], s["abandoned"]) for s in history(api, tool)] == [(False, False), (False, True), (True, False)]
    back = api.post(f"/tools/{tool['id']}/segmentations/{first['segmentation_id']}/restore", status=200)
    assert back["segmentation_id"] == first["segmentation_id"]
    assert back["edit"]["locked"] == []


@pytest.mark.parametrize("closed", [False, True])
def test_cut_along_a_line(api: Api, tool: dict[str, Any], closed: bool) -> None:
    here, *beside = [regions(api, tool)[0]["centroid_mm"], *ends_of(api, tool, 0)]
    path = [here, *beside] if closed else beside
    path = [[a + 0.4 * (b - a) for a, b in zip(here, p, strict=True)] for p in path] if closed else path
    edited = edit(api, tool, kind="cut", region=0, path_mm=path, closed=closed)
    assert edited["region_count"] == tool["region_count"] + 1
    assert edited["edit"]["undo"] == "Cut A along a line"
    assert sum(r["area_mm2"] for r in regions(api, tool)) == pytest.approx(total(api, tool), rel=1e-9)


def total(api: Api, tool: dict[str, Any]) -> float:
    api.post(f"/tools/{tool['id']}/segmentations/undo", status=200)
    area = sum(r["area_mm2"] for r in regions(api, tool))
    api.post(f"/tools/{tool['id']}/segmentations/redo", status=200)
    return area


def test_planes_grids_pieces_and_the_working_surface(api: Api, tool: dict[str, Any]) -> None:
    n = tool["region_count"]
    middle = regions(api, tool)[2]["centroid_mm"]
    assert edit(api, tool, kind="split_plane", region=2, point_mm=middle, normal=[1, 0, 0])["region_count"] == n + 1
    assert edit(api, tool, kind="split_plane", region=3, points_mm=ends_of(api, tool, 3))["region_count"] == n + 2
    grid = edit(api, tool, kind="split_grid", regions=[5], rows=2, columns=2)
    assert grid["region_count"] == n + 5
    assert grid["edit"]["undo"] == "Divided F into 2 x 2"
    off = edit(api, tool, kind="working", on=False, regions=[7])
    assert off["region_count"] == n + 4
    names = [r["name"] for r in regions(api, tool)]
    assert "H" not in names
    gone = regions(api, tool)
    merged = edit(api, tool, kind="merge", regions=[0, gone[0]["neighbours"][0]])
    inside = next(r for r in regions(api, tool) if r["name"] in (gone[0]["name"], gone[gone[0]["neighbours"][0]]["name"]))
    moved = edit(api, tool, kind="reassign", point_mm=inside["centroid_mm"], level=1, to="new")
    assert moved["region_count"] >= merged["region_count"] + 1
    assert "a region of its own" in moved["edit"]["undo"]
    assert moved["edit"]["step"] == 6
    for _ in range(6):
        tool = api.post(f"/tools/{tool['id']}/segmentations/undo", status=200)
    assert tool["region_count"] == n


def test_locked_regions_stay(api: Api, tool: dict[str, Any]) -> None:
    locked = edit(api, tool, kind="lock", regions=[0], on=True)
    assert locked["edit"]["locked"] == [0]
    assert locked["demonstrated"] is True, "a lock moves no border"
    other = regions(api, tool)[0]["neighbours"][0]
    refused = api.client.post(f"/api/v1/tools/{tool['id']}/segmentations", json={"edit": {"kind": "merge", "regions": [0, other]}})
    assert "A is locked. Unlock" in check_problem(refused, 422, "InvalidInput")
    hidden = edit(api, tool, kind="hide", regions=[1, 2], on=True)
    assert (hidden["edit"]["locked"], hidden["edit"]["hidden"]) == ([0], [1, 2])
    assert [r["locked"] for r in regions(api, tool)][:2] == [True, False]
    assert edit(api, tool, kind="lock", regions=[0], on=False)["edit"]["undo"] == "Unlocked A"
    assert edit(api, tool, kind="merge", regions=[0, other])["region_count"] == tool["region_count"] - 1


def test_names_join_the_history(api: Api, tool: dict[str, Any]) -> None:
    patched = api.call("PATCH", f"/tools/{tool['id']}/regions/4", 200, json={"name": "Lip"})
    assert patched["name"] == "Lip"
    row = api.get(f"/tools/{tool['id']}")
    assert row["edit"]["undo"] == "Renamed E to Lip"
    assert row["demonstrated"] is True
    edit(api, tool, kind="split_plane", region=0, point_mm=regions(api, tool)[0]["centroid_mm"], normal=[0, 1, 0])
    assert regions(api, tool)[4]["name"] == "Lip", "names given by people survive edits elsewhere"
    for _ in range(2):
        api.post(f"/tools/{tool['id']}/segmentations/undo", status=200)
    assert regions(api, tool)[4]["name"] == "E"


def test_orders_are_carried_over_where_regions_are_the_same(api: Api, tool: dict[str, Any]) -> None:
    """Dividing F and merging its halves again gives F with another number; merging two regions for good can't be mapped."""
    shown = api.get(f"/demonstrations/{tool['demonstration_id']}")
    assert (shown["on_current_cut"], shown["can_carry_over"], shown["why"]) == (True, False, "")
    edit(api, tool, kind="split_plane", region=5, point_mm=regions(api, tool)[5]["centroid_mm"], normal=[1, 0, 0])
    stale = api.get(f"/demonstrations/{shown['id']}")
    assert (stale["on_current_cut"], stale["can_carry_over"]) == (False, False)
    assert stale["why"].startswith("F was divided since, into F and ")
    assert "F was divided" in api.post(f"/demonstrations/{shown['id']}/carry-over", status=409)["detail"]
    edit(api, tool, kind="merge", regions=[5, tool["region_count"]])
    stale = api.get(f"/demonstrations/{shown['id']}")
    assert (stale["on_current_cut"], stale["can_carry_over"]) == (False, True)
    assert api.get(f"/tools/{tool['id']}")["demonstrated"] is False
    fresh = api.post(f"/demonstrations/{shown['id']}/carry-over")
    assert fresh["on_current_cut"] is True
    assert fresh["sequence"] == shown["sequence"]
    assert api.get(f"/demonstrations/{shown['id']}")["superseded_by"] == fresh["id"]
    assert api.get(f"/tools/{tool['id']}")["demonstrated"] is True
    api.post(f"/demonstrations/{fresh['id']}/carry-over", status=409)


def test_clicks_are_carried_over_too(api: Api, tool: dict[str, Any]) -> None:
    for region in (8, 3):
        api.post(f"/tools/{tool['id']}/draft/pick", {"region": region}, 200)
    edit(api, tool, kind="lock", regions=[11], on=True)
    assert api.get(f"/tools/{tool['id']}/draft")["sequence"] == [8, 3], "a lock moves no border"
    edit(api, tool, kind="working", on=False, regions=[5])
    draft = api.get(f"/tools/{tool['id']}/draft")
    assert (draft["sequence"], draft["older"]["placed"], draft["older"]["can_carry_over"]) == ([], 2, True)
    assert api.post(f"/tools/{tool['id']}/draft/carry-over", status=200)["sequence"] == [7, 3], "I is number 7 without F"
    api.post(f"/tools/{tool['id']}/draft/carry-over", status=409)
    edit(api, tool, kind="merge", regions=[3, regions(api, tool)[3]["neighbours"][0]])
    assert "were merged into" in api.post(f"/tools/{tool['id']}/draft/carry-over", status=409)["detail"]


def test_a_stale_page_is_refused_and_so_is_nonsense(api: Api, tool: dict[str, Any]) -> None:
    edit(api, tool, kind="lock", regions=[0], on=True)
    body = {"edit": {"kind": "lock", "regions": [1], "on": True}, "segmentation_id": tool["segmentation_id"]}
    assert "changed meanwhile" in api.post(f"/tools/{tool['id']}/segmentations", body, 412)["detail"]
    for wrong in (
        {"kind": "melt"},
        {"kind": "merge", "regions": [1]},
        {"kind": "merge", "regions": [0, 99]},
        {"kind": "split_plane", "region": 1},
        {"kind": "split_plane", "region": 1, "points_mm": [[0, 0, 0]]},
        {"kind": "split_grid", "regions": [1]},
        {"kind": "split_grid", "regions": [1], "rows": 1, "columns": 1},
        {"kind": "cut", "region": 1, "path_mm": [[0, 0, 0], [1e5, 0, 0]]},
        {"kind": "cut", "path_mm": [[0, 0, 0], [1, 0, 0]]},
        {"kind": "reassign", "point_mm": [1e6, 0, 0]},
        {"kind": "reassign", "point_mm": ["NaN", 0, 0]},
        {"kind": "working", "regions": [1]},
        {"kind": "working", "on": True},
        {"kind": "working", "on": False, "regions": list(range(tool["region_count"]))},
        {"kind": "rename", "region": 1, "name": "A"},
        {"kind": "hide", "regions": [], "on": True},
    ):
        edit(api, tool, 422, **wrong)
    assert len(history(api, tool)) == 2


def test_a_tool_stays_as_it_is_while_a_run_learns_from_it(api: Api, tool: dict[str, Any]) -> None:
    run = api.post(f"/projects/{tool['project_id']}/runs", {"kind": "performance"}, 202)
    api.until(f"/runs/{run['id']}", lambda row: row["state"] == "waiting_for_expert", seconds=120)
    assert api.get(f"/tools/{tool['id']}")["edit"]["editable"] is False
    assert "learning from" in edit(api, tool, 409, kind="merge", regions=[0, 1])["detail"]
    edit(api, tool, 201, kind="lock", regions=[0], on=True)
    api.post(f"/runs/{run['id']}/cancel", status=202)
    api.until(f"/runs/{run['id']}", lambda row: row["state"] == "cancelled")
    assert edit(api, tool, kind="merge", regions=[1, regions(api, tool)[1]["neighbours"][-1]])["edit"]["editable"] is True


def imported(api: Api) -> dict[str, Any]:
    """A box made a tool."""
    project = api.post("/projects", {"name": "Moulds"})
    part = trimesh.creation.box((0.4, 0.3, 0.1)).subdivide().subdivide()
    tool = api.upload(f"/projects/{project['id']}/tools", "Box.stl", part.export(file_type="stl"), units="m", up="+z")
    return api.until(f"/tools/{tool['id']}", lambda row: row["state"] == "ready")


def test_slider_answers_at_once_and_leaves_locked_regions_alone(api: Api) -> None:
    tool = imported(api)
    assert tool["edit"]["can_undo"] is False
    path = f"/tools/{tool['id']}/segmentations"
    six = api.post(path, {"target": 6, "now": True})
    assert six["region_count"] == 6
    api.call("PATCH", f"/tools/{tool['id']}/regions/2", 200, json={"name": "Lid"})
    kept = regions(api, tool)[2]
    edit(api, tool, kind="lock", regions=[2], on=True)
    ten = api.post(path, {"target": 10, "now": True})
    assert ten["region_count"] == 10
    lid = next(r for r in regions(api, tool) if r["name"] == "Lid")
    assert lid["area_mm2"] == pytest.approx(kept["area_mm2"], rel=1e-9)
    assert lid["locked"]
    assert sum(r["area_mm2"] for r in regions(api, tool)) >= kept["area_mm2"] * 2
    again = api.post(path, {"target": 3}, 202)
    again = api.until(f"/tools/{tool['id']}", lambda row: row["state"] == "ready")
    assert again["edit"]["undo"].startswith("Cut into ")
    assert next(r for r in regions(api, tool) if r["name"] == "Lid")["area_mm2"] == pytest.approx(kept["area_mm2"], rel=1e-9)
    smooth = api.post(path, {"target": 5, "denoise": True, "now": True})
    assert smooth["edit"]["locked"] == [0]
    for _ in range(6):
        back = api.post(f"{path}/undo", status=200)
    assert back["region_count"] == tool["region_count"]
    assert back["segmentation_id"] == tool["segmentation_id"]


def test_one_drag_of_the_slider_is_one_step(api: Api) -> None:
    """While it is dragged, each cut takes the place of the one before; not one that somebody has used, and not the next drag."""
    tool = imported(api)
    path = f"/tools/{tool['id']}/segmentations"
    assert tool["edit"]["slider"] == {"least": 1, "most": 60, "current": tool["region_count"], "now": True}
    for target in (12, 11, 10):
        cut = api.post(path, {"target": target, "now": True, "continues": target != 12})
    assert (cut["region_count"], cut["edit"]["step"], cut["edit"]["slider"]["current"]) == (10, 1, 10)
    assert [step["region_count"] for step in history(api, tool)] == [tool["region_count"], 10]
    api.post(f"/tools/{tool['id']}/demonstrations", {"sequence": list(range(10))})
    used = api.post(path, {"target": 9, "now": True, "continues": True})
    assert used["edit"]["step"] == 2
    again = api.post(path, {"target": 8, "now": True})
    assert again["edit"]["step"] == 3
    assert api.post(f"{path}/undo", status=200)["region_count"] == 9


def test_a_drag_beside_locked_regions_leaves_no_trace(api: Api) -> None:
    """Whatever positions it went through, the cut is the one of its last position."""
    tool = imported(api)
    path = f"/tools/{tool['id']}/segmentations"
    api.post(path, {"target": 6, "now": True})
    edit(api, tool, kind="lock", regions=[1, 4], on=True)
    api.post(path, {"target": 10, "now": True})
    straight = regions(api, tool)
    api.post(f"{path}/undo", status=200)
    for target in (30, 17, 10):
        cut = api.post(path, {"target": target, "now": True, "continues": target != 30})
    assert cut["region_count"] == 10
    assert cut["edit"]["locked"] == [0, 1]
    assert regions(api, tool) == straight
    assert api.post(f"{path}/undo", status=200)["edit"]["locked"] == [1, 4]


def test_colours_of_the_file_stay_while_the_tool_does(api: Api, tool: dict[str, Any]) -> None:
    assert {region["colour"] for region in regions(api, tool)} == {None}, "a sample has no CAD file"
    view = api.post("/sessions", {"project_id": tool["project_id"]})
    scene = {"mode": "edit", "tool_id": tool["id"]}
    shown = api.call("PUT", f"/sessions/{view['id']}/scene", 200, json={**scene, "colours": "cad"})
    assert shown["scene"]["colours"] == "cad"
    assert api.call("PUT", f"/sessions/{view['id']}/scene", 200, json={**scene, "dark": True})["scene"]["colours"] == "cad"
    api.call("PUT", f"/sessions/{view['id']}/scene", 422, json={**scene, "colours": "red"})


def test_table_of_regions(api: Api, tool: dict[str, Any]) -> None:
    api.call("PATCH", f"/tools/{tool['id']}/regions/0", 200, json={"name": "=1+1"})
    response = api.client.get(f"/api/v1/tools/{tool['id']}/regions.csv")
    assert response.headers["content-type"].startswith("text/csv")
    rows = list(csv.DictReader(io.StringIO(response.text)))
    known = regions(api, tool)
    assert len(rows) == len(known)
    assert rows[0]["name"] == "'=1+1", "no formula for a spreadsheet"
    for row, region in zip(rows, known, strict=True):
        assert float(row["area_mm2"]) == pytest.approx(region["area_mm2"], rel=1e-5)
        assert float(row["perimeter_mm"]) == pytest.approx(region["perimeter_mm"], rel=1e-5)
        assert 0 <= float(row["free_border_mm"]) <= float(row["perimeter_mm"]) * (1 + 1e-5)
        assert float(row["length_mm"]) / float(row["width_mm"]) == pytest.approx(region["aspect"], rel=1e-4)
        assert len(row["neighbour_angles_deg"].split()) == len(region["neighbours"])
    assert sum(float(row["free_border_mm"]) for row in rows) > 0


def test_how_regions_lie_to_each_other(api: Api, tool: dict[str, Any]) -> None:
    """Both lists of neighbours agree; ways along the surface are at least straight lines, the same both ways."""
    known, near = regions(api, tool), api.get(f"/tools/{tool['id']}/neighbours")
    for touch, key in (("border", "neighbours"), ("corner", "corner_neighbours")):
        pairs = {(p["a"], p["b"]) for p in near["items"] if p["touch"] == touch}
        assert pairs == {(r["id"], b) for r in known for b in r[key] if r["id"] < b}
    assert all((p["angle_deg"] is None) == (p["touch"] == "corner") for p in near["items"])
    for p in near["items"]:
        straight = math.dist(known[p["a"]]["centroid_mm"], known[p["b"]]["centroid_mm"])
        assert p["distance_mm"] == near["distances_mm"][p["b"]][p["a"]]
        assert p["distance_mm"] > 0.9 * straight  # centroids of bent regions lie beside the surface


def test_undo_survives_a_restart(settings: Settings, tmp_path: Any) -> None:
    from starlette.testclient import TestClient

    def opened() -> TestClient:
        return TestClient(create_app(settings), base_url="http://127.0.0.1:8765")

    with opened() as client:
        api = Api(client)
        project = api.post("/projects/sample")
        tool = api.get(f"/projects/{project['id']}/tools")["items"][0]
        before = regions(api, tool)
        edit(api, tool, kind="merge", regions=[0, before[0]["neighbours"][0]])
        after = regions(api, tool)
    with opened() as client:
        api = Api(client)
        assert regions(api, tool) == after
        api.post(f"/tools/{tool['id']}/segmentations/undo", status=200)
        assert regions(api, tool) == before
    with opened() as client:
        api = Api(client)
        api.post(f"/tools/{tool['id']}/segmentations/redo", status=200)
        assert regions(api, tool) == after


def test_a_view_follows_the_edits(api: Api, tool: dict[str, Any]) -> None:
    view = api.post("/sessions", {"project_id": tool["project_id"]})
    scene = {"mode": "edit", "tool_id": tool["id"], "selection": [1, 2]}
    assert api.call("PUT", f"/sessions/{view['id']}/scene", 200, json=scene)["scene"]["selection"] == [1, 2]
    kept = api.call("PUT", f"/sessions/{view['id']}/scene", 200, json={"mode": "edit", "tool_id": tool["id"], "dark": True})["scene"]
    assert (kept["selection"], kept["dark"], kept["pointing"]) == ([1, 2], True, "select")
    other = regions(api, tool)[0]["neighbours"][0]
    scene = api.call("PATCH", f"/sessions/{view['id']}/scene", 200, json={"selection": [0, other, 5]})["scene"]
    assert scene["selection"] == sorted([0, other, 5])
    edit(api, tool, kind="merge", regions=[0, other])
    assert api.get(f"/sessions/{view['id']}")["scene"]["selection"] == [0], "what was made is selected"
    point = regions(api, tool)[0]["centroid_mm"]
    api.call("PATCH", f"/sessions/{view['id']}/scene", 200, json={"pointing": "piece", "points": [{"point_mm": point}], "level": 2})
    api.call("PATCH", f"/sessions/{view['id']}/scene", 200, json={"hover": 3})
    api.post(f"/tools/{tool['id']}/segmentations/undo", status=200)
    after = api.get(f"/sessions/{view['id']}")["scene"]
    assert (after["selection"], after["points"], after["level"]) == ([], [], 1)
    api.call("PATCH", f"/sessions/{view['id']}/scene", 422, json={"selection": [99]})
    api.call("PUT", f"/sessions/{view['id']}/scene", 200, json={"mode": "empty"})
    api.call("PATCH", f"/sessions/{view['id']}/scene", 422, json={"selection": [0]})
