"""Attributes of regions against closed forms on a box, a cylinder, an L-profile with a fillet, a frustum and a sphere cap."""

from dataclasses import replace

import numpy as np
import pytest

from app.geometry.distances import surface_distances
from app.geometry.moulds import Mould, sample_moulds
from app.geometry.neighbours import Neighbours, find_neighbours
from app.geometry.regions import measure, measure_labelled
from app.geometry.sizes import region_sizes
from app.geometry.tool import Array, Mesh, Tool
from tests.geometry.test_regions import rotated_about_z, surface, unit_grid


def developed(radius: float, rise: float, turn: float, height: float, cells: np.ndarray, cut: float = 0.0) -> Tool:
    """A patch of a cylinder or cone around z: radius + rise * z, `turn` rad wide; looks outward."""
    t, z = (np.linspace(0, span, count + 1) for span, count in zip((turn, height), cells.shape, strict=True))
    t, z = np.meshgrid(t + cut, z, indexing="ij")
    r = radius + rise * z
    mesh, labels = surface(np.stack([r * np.cos(t), r * np.sin(t), z], -1), cells)
    if turn > 2 * np.pi - 1e-9:  # closed: the last row of vertices is the first
        faces = np.where(mesh.faces >= t.size - t.shape[1], mesh.faces - (t.size - t.shape[1]), mesh.faces)
        mesh = Mesh(mesh.vertices[: t.size - t.shape[1]], faces)
    return measure(mesh, labels)


def profile(points: list[tuple[float, float]], labels: list[int], depth: float = 0.4, steps: int = 4) -> Tool:
    """A line in the x-z plane drawn out along y; one label per segment."""
    x, z = np.array(points).T
    grid = np.stack([np.stack([x, np.full_like(x, y), z], -1) for y in np.linspace(0, depth, steps + 1)], axis=1)
    return measure_labelled(*surface(grid, np.repeat(np.array(labels)[:, None], steps, axis=1)))


def l_profile(fillet: int, angle: float = np.pi / 2, radius: float = 0.02, side: float = 0.5, sign: int = 1) -> Tool:
    """Level floor, a fillet that turns up (sign 1) or down by `angle`, then a straight wall; `fillet` is its region."""
    t = np.linspace(0, angle, 17)
    arc = np.stack([side + radius * np.sin(t), sign * radius * (1 - np.cos(t))], axis=1)
    end = arc[-1] + side * np.array([np.cos(angle), sign * np.sin(angle)])
    return profile([(0.0, 0.0), *map(tuple, arc.tolist()), tuple(end.tolist())], [0] + [fillet] * 16 + [1])


def pair(tool: Tool, a: int, b: int) -> Neighbours:
    return next(p for p in find_neighbours(tool) if (p.a, p.b) == (a, b))


def box(size: Array) -> Tool:
    """All six sides of a box, one region each: left, right, front, rear, bottom, top."""
    v = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)]) * size
    quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    faces = [three for a, b, c, d in quads for three in ((a, b, c), (a, c, d))]
    return measure_labelled(Mesh(v, np.array(faces, np.int32)), np.repeat(np.arange(6), 2).astype(np.int32))


class TestBox:
    tool = box(np.array([0.6, 0.3, 0.2]))

    def test_sides(self) -> None:
        sizes = region_sizes(self.tool)
        assert [(s.length, s.width) for s in sizes] == [pytest.approx(x) for x in [(0.3, 0.2)] * 2 + [(0.6, 0.2)] * 2 + [(0.6, 0.3)] * 2]
        assert [s.aspect for s in sizes] == pytest.approx([1.5, 1.5, 3, 3, 2, 2])
        assert sizes[0].direction == pytest.approx(np.pi / 2)  # left: along y
        assert [sizes[k].direction for k in (2, 4)] == pytest.approx([0.0, 0.0])  # front and bottom: along x

    def test_all_edges_are_right_angled_ridges(self) -> None:
        pairs = find_neighbours(self.tool)
        assert len(pairs) == 12
        assert {p.touch for p in pairs} == {"border"}
        assert [p.angle for p in pairs] == pytest.approx([np.pi / 2] * 12)
        assert pair(self.tool, 0, 2).border == pytest.approx(0.2)

    def test_ways_over_the_edges(self) -> None:
        """Unfolded: neighbours a straight way over one edge; opposite sides over two, the shorter way round."""
        way = surface_distances(self.tool.mesh, self.tool.labels, np.array([r.centroid for r in self.tool.regions]))
        assert way[0, 2] == pytest.approx(0.3 + 0.15, rel=2e-3)
        assert way[0, 5] == pytest.approx(0.1 + 0.3, rel=2e-3)
        assert way[0, 1] == pytest.approx(0.6 + 0.2, rel=2e-3)
        assert way[4, 5] == pytest.approx(0.2 + 0.3, rel=2e-3)


@pytest.mark.parametrize("cut", [0.0, 2.0, 3.1, 5.0])
@pytest.mark.parametrize("turn", [1.2, 4.5, 2 * np.pi])
def test_cylinder_unrolls_to_arc_by_height(turn: float, cut: float) -> None:
    tool = developed(0.2, 0.0, turn, 0.3, np.zeros((48, 3), int), cut)
    assert tool.regions[0].kind == "cylinder"
    size = region_sizes(tool)[0]
    assert (size.length, size.width) == pytest.approx(sorted((0.2 * turn, 0.3), reverse=True), rel=1e-9)


def test_half_a_cylinder_is_longer_than_its_box() -> None:
    """0.628 m along the surface by 0.3 m; the box of its points is 0.4 m wide."""
    assert region_sizes(developed(0.2, 0.0, np.pi, 0.3, np.zeros((48, 3), int)))[0].aspect == pytest.approx(0.2 * np.pi / 0.3, rel=1e-9)


@pytest.mark.parametrize("turn", [1.0, 4.0, 2 * np.pi])
def test_frustum_unrolls_to_mean_arc_by_slant(turn: float) -> None:
    """Radii 0.2 and 0.1 m, 0.3 m high; curvature at the mean square radius, cos(slant) / sqrt((0.2^2 + 0.1^2) / 2), outwards."""
    tool = developed(0.2, -1 / 3, turn, 0.3, np.zeros((64, 2), int))
    region, size, slant = tool.regions[0], region_sizes(tool)[0], np.hypot(0.3, 0.1)
    assert region.kind == "cone"
    assert region.curvature == pytest.approx(0.3 / slant / np.sqrt(0.025), rel=0.02)
    assert (size.length, size.width) == pytest.approx(sorted((0.15 * turn, slant), reverse=True), rel=1e-6)


def test_kinds() -> None:
    """Sphere cap, saddle (one quadric), and a wave that no quadric describes."""
    x, y = np.meshgrid(np.linspace(-0.2, 0.2, 21), np.linspace(-0.2, 0.2, 21), indexing="ij")
    whole = np.zeros((20, 20), int)
    shapes = {
        "sphere": np.sqrt(0.16 - x**2 - y**2),
        "curved": x**2 - 0.6 * y**2 + 0.1 * x,
        "freeform": 0.03 * np.sin(25 * x),
        "plane": x / 3,
    }
    for kind, z in shapes.items():
        assert measure(*surface(np.stack([x, y, z], -1), whole)).regions[0].kind == kind


@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize("degrees", [35, 90])
def test_angle_across_a_fillet(degrees: float, sign: int) -> None:
    """The fillet a region of its own, or absorbed by either face: the faces meet at the angle it turns by, + outwards (down)."""
    angle = np.radians(degrees)
    apart = l_profile(2, angle, sign=sign)
    assert apart.regions[2].kind == "cylinder"
    assert abs(apart.regions[2].curvature) == pytest.approx(1 / 0.02, rel=0.01)
    across = pair(apart, 0, 1)
    assert (across.touch, across.across) == ("rounding", 2)
    assert across.angle == pytest.approx(-sign * angle, abs=1e-9)
    assert across.border == pytest.approx(0.4)
    assert pair(apart, 0, 2).angle == pytest.approx(0, abs=1e-9)
    for owner in (0, 1):
        absorbed = pair(l_profile(owner, angle, sign=sign), 0, 1)
        assert absorbed.touch == "border"
        assert absorbed.angle == pytest.approx(-sign * angle, abs=1e-6)


def test_a_wide_rounding_is_a_face_of_its_own() -> None:
    assert [(p.a, p.b) for p in find_neighbours(l_profile(2, radius=0.3))] == [(0, 2), (1, 2)]


def test_way_through_a_fillet_is_straight_arc_straight() -> None:
    tool = l_profile(2, radius=0.1)
    way = surface_distances(tool.mesh, tool.labels, np.array([r.centroid for r in tool.regions]))
    assert way[0, 1] == pytest.approx(0.25 + 0.1 * np.pi / 2 + 0.25, rel=1e-3)


def test_corner_and_border_neighbours_of_a_grid() -> None:
    """3 x 4 squares: 17 borders of 1 m and 12 corners."""
    pairs = find_neighbours(measure(*unit_grid()))
    assert [sum(p.touch == touch for p in pairs) for touch in ("border", "corner")] == [17, 12]
    assert {round(p.border, 9) for p in pairs if p.touch == "border"} == {1.0}
    assert {p.angle for p in pairs if p.touch == "border"} == {0.0}
    assert {(p.border, p.angle) for p in pairs if p.touch == "corner"} == {(0.0, None)}
    first = {(p.b, p.touch) for p in pairs if p.a == 0}
    assert first == {(1, "border"), (4, "border"), (5, "corner")}


def spherical(a: Array, b: Array) -> float:
    return float(np.arccos(np.clip(a @ b / np.linalg.norm(a) / np.linalg.norm(b), -1, 1)))


def test_ways_over_a_sphere_and_around_a_cylinder() -> None:
    """Great circles, and helices r dphi by dz, from middle to middle."""
    angles = np.linspace(-0.8, 0.8, 33)
    u, v = np.meshgrid(angles, angles, indexing="ij")
    grid = 0.5 * np.stack([np.sin(u), np.cos(u) * np.sin(v), np.cos(u) * np.cos(v)], -1)
    cells = (np.arange(32) // 8)[:, None] * 4 + (np.arange(32) // 8)[None]
    ball = measure(*surface(grid, cells))
    at = np.array([r.centroid for r in ball.regions])
    true = 0.5 * np.array([[spherical(a, b) for b in at] for a in at])
    np.fill_diagonal(true, 0)
    assert surface_distances(ball.mesh, ball.labels, at) == pytest.approx(true, rel=5e-3, abs=1e-9)
    tube = developed(0.2, 0.0, 3.0, 0.6, cells)
    at = np.array([r.centroid for r in tube.regions])
    around = np.arctan2(at[:, 1], at[:, 0])
    true = np.hypot(0.2 * (around[:, None] - around), at[:, None, 2] - at[:, 2])
    assert surface_distances(tube.mesh, tube.labels, at) == pytest.approx(true, rel=5e-3, abs=1e-9)


def test_separate_pieces_are_not_reached() -> None:
    x, y = np.meshgrid([0.0, 1, 2, 3], [0.0, 1], indexing="ij")
    mesh, labels = surface(np.stack([x, y, 0 * x], -1), np.array([[0], [-1], [1]]))
    assert surface_distances(mesh, labels, np.array([[0.5, 0.5, 0], [2.5, 0.5, 0]]))[0, 1] == np.inf


@pytest.mark.parametrize("mould", sample_moulds()[::3], ids=lambda m: m.name)
def test_turning_a_tool_leaves_sizes_angles_and_ways_alone(mould: Mould) -> None:
    before = measure_labelled(mould.mesh, mould.labels)
    after = measure_labelled(rotated_about_z(mould.mesh, 0.7, np.array([1.0, -2.0, 0.5])), mould.labels)
    for one, other in zip(region_sizes(before), region_sizes(after), strict=True):
        assert (one.length, one.width) == pytest.approx((other.length, other.width), rel=1e-4)
    for one, other in zip(find_neighbours(before), find_neighbours(after), strict=True):
        assert replace(one, border=0, angle=0) == replace(other, border=0, angle=0)
        assert (one.border, one.angle or 0) == pytest.approx((other.border, other.angle or 0), abs=1e-6)
    ways = [surface_distances(t.mesh, t.labels, np.array([r.centroid for r in t.regions])) for t in (before, after)]
    assert ways[0] == pytest.approx(ways[1], rel=0.03)  # where two points are nearest to a centroid, rounding chooses the middle


@pytest.mark.parametrize("sign", [1, -1])
def test_tilt_changes_by_the_angle_of_the_faces_whichever_has_the_fillet(sign: int) -> None:
    """A fillet of a tenth of the side turns the mean normal by degrees; the change of tilt stays that of the flat faces."""
    for owner in (0, 1):
        tool = l_profile(owner, np.radians(50), radius=0.05, sign=sign)
        assert tool.graph.angle == pytest.approx(np.radians(50) * np.array([[0, 1], [-1, 0]]), abs=1e-6)
        assert [r.kind for r in tool.regions] == ["plane"] * 2
        assert [r.curvature for r in tool.regions] == [0, 0]


def test_a_flat_plate_with_a_wall_at_its_edge_is_a_plane() -> None:
    """A level plate and the wall of a slot, a fifth as large: one region, still a plane."""
    tool = profile([(0, 0), (0.5, 0), (0.5, 0.1)], [0, 0])
    assert (tool.regions[0].kind, tool.regions[0].curvature) == ("plane", 0)


def test_the_narrow_wall_around_a_plate_is_a_cylinder() -> None:
    """A band of a sphere of 0.4 m, 10 mm high: its normals turn by 1.4 degrees upwards, which is nothing to call it a sphere for."""
    t, z = np.meshgrid(np.linspace(0, 5, 60), np.linspace(-0.005, 0.005, 5), indexing="ij")
    r = np.sqrt(0.16 - z**2)
    region = measure(*surface(np.stack([r * np.cos(t), r * np.sin(t), z], -1), np.zeros((59, 4), int))).regions[0]
    assert (region.kind, region.curvature) == ("cylinder", pytest.approx(2.5, rel=0.02))
