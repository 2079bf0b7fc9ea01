"""Region graph and attributes against closed forms: unit grid, roof and valley, cylinder, sphere, the sample moulds."""

from dataclasses import fields

import numpy as np
import pytest

from app.errors import InvalidInput
from app.geometry.moulds import Mould, arc, sample_moulds, sphere_patch, straight, translational
from app.geometry.plan_frame import plan_boxes
from app.geometry.regions import measure, reading_order
from app.geometry.tool import Array, Mesh, Tool
from app.sequencing.problem import problem_for

MOULDS = sample_moulds()


def surface(grid: Array, cells: np.ndarray) -> tuple[Mesh, np.ndarray]:
    """Open surface over a grid (U, V, 3); every cell is two triangles facing up."""
    u, v = grid.shape[:2]
    index = np.arange(u * v).reshape(u, v)
    a, b, c, d = index[:-1, :-1], index[1:, :-1], index[1:, 1:], index[:-1, 1:]
    faces = np.stack([np.stack([a, b, c], -1), np.stack([a, c, d], -1)], axis=2).reshape(-1, 3)
    return Mesh(grid.reshape(-1, 3), faces.astype(np.int32)), np.repeat(cells.ravel(), 2).astype(np.int32)


def unit_grid(rows: int = 3, columns: int = 4, fine: int = 2) -> tuple[Mesh, np.ndarray]:
    """Level unit squares, `fine` cells along each side."""
    x, y = np.meshgrid(np.arange(columns * fine + 1) / fine, np.arange(rows * fine + 1) / fine, indexing="ij")
    i, j = np.meshgrid(np.arange(columns * fine) // fine, np.arange(rows * fine) // fine, indexing="ij")
    return surface(np.stack([x, y, np.zeros_like(x)], -1), i * rows + j)


def folded(rise: float) -> Tool:
    """Two unit squares in plan that meet along y; the ridge at x = 1 stands `rise` above both feet."""
    x, y = np.meshgrid([0.0, 1.0, 2.0], [0.0, 1.0], indexing="ij")
    return measure(*surface(np.stack([x, y, rise * (1 - np.abs(x - 1))], -1), np.array([[0], [1]])))


def rotated_about_z(mesh: Mesh, angle: float, shift: Array) -> Mesh:
    c, s = np.cos(angle), np.sin(angle)
    return Mesh(mesh.vertices @ np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]]) + shift, mesh.faces)


class TestUnitGrid:
    tool = measure(*unit_grid())
    graph = tool.graph

    def test_shared_lengths_are_a_quarter_of_the_perimeter(self) -> None:
        assert self.graph.shared[self.graph.neighbour] == pytest.approx(0.25)
        assert (self.graph.shared[~self.graph.neighbour] == 0).all()

    def test_neighbours_and_free_borders(self) -> None:
        """Corners have 2 neighbours and half their border free, sides 3 and a quarter, the middle 4 and none."""
        expected = np.array([2, 3, 3, 2, 3, 4, 4, 3, 2, 3, 3, 2])
        assert self.graph.neighbour.sum(axis=1).tolist() == expected.tolist()
        assert 1 - self.graph.shared.sum(axis=1) == pytest.approx((4 - expected) / 4)

    def test_corner_neighbours(self) -> None:
        assert self.graph.corner.sum(axis=1).tolist() == [1, 2, 2, 1, 2, 4, 4, 2, 1, 2, 2, 1]
        assert not (self.graph.corner & self.graph.neighbour).any()

    def test_opposite_of_a_free_side(self) -> None:
        """A (rear left) is free behind and to the left; across lie E (in front) and B (to the right). F has no free side."""
        assert np.flatnonzero(self.graph.opposite[0]).tolist() == [1, 4]
        assert self.graph.opposite[0, [1, 4]] == pytest.approx(0.25)
        assert np.flatnonzero(self.graph.opposite[1]).tolist() == [5]
        assert (self.graph.opposite[5] == 0).all()

    def test_opposite_does_not_depend_on_the_sides_names(self) -> None:
        assert self.graph.opposite.sum(axis=1) == pytest.approx(np.array([2, 1, 1, 2, 1, 0, 0, 1, 2, 1, 1, 2]) / 4)

    def test_areas_heights_angles_and_curvature(self) -> None:
        assert self.graph.area == pytest.approx(1 / 12)
        assert [r.area for r in self.tool.regions] == pytest.approx([1.0] * 12)
        assert (self.graph.height == 1).all()
        assert (self.graph.angle == 0).all()
        assert (self.graph.curvature == 0).all()
        assert {r.kind for r in self.tool.regions} == {"plane"}

    def test_letters_run_row_by_row_from_the_rear_left(self) -> None:
        assert "".join(r.name for r in self.tool.regions) == "ABCDEFGHIJKL"
        middles = [tuple(r.centroid[:2].round(9)) for r in self.tool.regions]
        assert middles == [(x + 0.5, y + 0.5) for y in (2, 1, 0) for x in range(4)]

    def test_first_neighbour_and_boxes(self) -> None:
        assert self.graph.first.tolist() == [1, 0, 1, 2, 0, 1, 2, 3, 4, 5, 6, 7]
        assert self.graph.low[0] * np.sqrt(12) == pytest.approx([0, 2])
        assert self.graph.high[0] * np.sqrt(12) == pytest.approx([1, 3])


def test_area_counts_as_seen_from_above() -> None:
    """A level square beside one that rises by 3 has equal shares of the plan, though its true area is sqrt(10) times larger."""
    x, y = np.meshgrid([0.0, 1.0, 2.0], [0.0, 1.0], indexing="ij")
    tool = measure(*surface(np.stack([x, y, 3 * np.maximum(x - 1, 0)], -1), np.array([[0], [1]])))
    assert tool.graph.area == pytest.approx(0.5)
    assert [r.area for r in tool.regions] == pytest.approx([1, np.sqrt(10)])
    assert tool.graph.height == pytest.approx([0, 1])


@pytest.mark.parametrize("rise", [4 / 3, -4 / 3])
def test_tilt_does_not_change_across_a_symmetric_ridge(rise: float) -> None:
    graph = folded(rise).graph
    assert graph.angle == pytest.approx(np.zeros((2, 2)), abs=1e-12)
    assert graph.height == pytest.approx([1, 1])


def test_tilt_angles_of_roof_and_valley_are_antisymmetric() -> None:
    """Level, then rising 4 on 3 (53.1301 degrees), then level: the middle is steeper than both by that angle."""
    x, y = np.meshgrid([0.0, 1.0, 1.75, 2.75], [0.0, 1.0], indexing="ij")
    for sign in (1, -1):
        z = sign * np.clip((x - 1) * 4 / 3, 0, 1)
        angle = np.degrees(measure(*surface(np.stack([x, y, z], -1), np.array([[0], [1], [2]]))).graph.angle)
        assert angle == pytest.approx(-angle.T)
        assert angle[0, 1] == pytest.approx(53.1301, abs=1e-4)
        assert angle[1, 2] == pytest.approx(-53.1301, abs=1e-4)
        assert angle[0, 2] == 0


@pytest.mark.parametrize("turn", [-80, -20, 20, 80])
def test_cylinder_curvature(turn: float) -> None:
    """An arc of 0.4 m that turns by `turn` has radius 0.4 / turn; a crown (turning down) counts as convex, +."""
    tool = measure(*surface(*translational(arc(0.4, 2, np.radians(turn)), straight(0.5, 2))))
    true = -np.radians(turn) / 0.4
    assert [r.kind for r in tool.regions] == ["cylinder"] * 4
    assert [r.curvature for r in tool.regions] == pytest.approx([true] * 4, rel=0.02)
    total = sum(r.area for r in tool.regions)
    assert tool.graph.curvature == pytest.approx(np.clip(true * np.sqrt(total), -1, 1), rel=0.02)


@pytest.mark.parametrize("sign", [1, -1])
def test_sphere_curvature(sign: int) -> None:
    grid, cells = sphere_patch(0.4, 0.4, 0.5, 2, 2)
    tool = measure(*surface(grid * [1, 1, sign], cells))
    assert [r.kind for r in tool.regions] == ["sphere"] * 4
    assert [r.curvature for r in tool.regions] == pytest.approx([sign * 2.0] * 4, rel=0.02)


def curvatures(name: str) -> dict[str, tuple[str, float]]:
    mould = next(m for m in MOULDS if m.name.startswith(name))
    return {r.description: (r.kind, r.curvature) for r in measure(mould.mesh, mould.labels).regions}


@pytest.mark.parametrize(
    ("name", "region", "kind", "true"),
    [
        ("Bend", "Fillet, rear", "cylinder", -np.radians(48) / 0.09),
        ("Bend", "Right slope, front", "plane", 0.0),
        ("Barrel", "Crown, rear", "cylinder", np.radians(85) / 0.40),
        ("Trough", "Hollow, front", "cylinder", -np.radians(80) / 0.22),
        ("Dome", "Rear slope, left", "sphere", 1 / 0.36),
        ("Dish", "Hollow, middle", "sphere", -1 / 0.20),
        ("Hood", "Crown, rear left", "cylinder", np.radians(45) / 0.42),
    ],
)
def test_sample_moulds_have_the_radii_they_are_built_with(name: str, region: str, kind: str, true: float) -> None:
    found, curvature = curvatures(name)[region]
    assert found == kind
    assert curvature == pytest.approx(true, rel=0.02)


def test_doubly_curved_regions_are_quadrics_and_keep_the_larger_curvature() -> None:
    """Saddle: -60 degrees over 0.38 m across, +70 degrees over 0.46 m along. Hood: 70 degrees over 0.24 m is the larger."""
    across, along = np.radians(60) / 0.38, np.radians(70) / 0.46
    for kind, curvature in curvatures("Saddle").values():
        assert kind == "curved"
        assert 0.9 * min(across, along) < abs(curvature) < max(across, along)
    assert curvatures("Saddle")["Hollow, rear middle"][1] < 0 < curvatures("Saddle")["Rear slope, middle"][1]
    for place in ("rear", "rear middle", "front middle", "front"):
        assert curvatures("Hood")[f"Crown, {place} right"] == ("curved", pytest.approx(np.radians(70) / 0.24, rel=0.05))


MOTIONS = ((0.0, (1.0, -2.0, 0.5)), (np.pi / 2, (0.3, 0.1, -4.0)), (0.4, (0.0, 0.0, 0.0)))


def matched(before: Tool, after: Tool) -> np.ndarray:
    """Region of `after` on the same triangles as each region of `before`."""
    inside = before.labels >= 0
    match = np.empty(before.n, int)
    match[before.labels[inside]] = after.labels[inside]
    return match


@pytest.mark.parametrize("mould", MOULDS, ids=lambda m: m.name)
def test_rigid_motion_about_z_leaves_the_graph_alone(mould: Mould) -> None:
    """A quarter turn permutes letters; matched by place, all must agree, of the plan boxes the gaps around sets of regions."""
    before = measure(mould.mesh, mould.labels)
    for angle, shift in MOTIONS:
        after = measure(rotated_about_z(mould.mesh, angle, np.array(shift)), mould.labels)
        match = matched(before, after)
        for name in ("shared", "angle", "neighbour", "corner"):
            assert np.allclose(getattr(before.graph, name), getattr(after.graph, name)[np.ix_(match, match)], atol=1e-6), name
        for name in ("curvature", "height", "area"):
            assert np.allclose(getattr(before.graph, name), getattr(after.graph, name)[match], atol=1e-6), name


@pytest.mark.parametrize("mould", MOULDS, ids=lambda m: m.name)
def test_rigid_motion_about_z_leaves_the_clean_features_alone(mould: Mould) -> None:
    """Every feature of every step of some orders."""
    before = measure(mould.mesh, mould.labels)
    for angle, shift in (*MOTIONS, (0.7, (0.0, 0.0, 0.0)), (2.9, (0.0, 0.0, 0.0))):
        after = measure(rotated_about_z(mould.mesh, angle, np.array(shift)), mould.labels)
        match = matched(before, after)
        one, other = problem_for(before.graph), problem_for(after.graph)
        for seed in range(5):
            order = np.random.default_rng(seed).permutation(before.n)
            np.testing.assert_allclose(one.feature_sum(order), other.feature_sum(match[order]), atol=1e-6, err_msg=str(angle))


def test_boxes_of_an_octagon_follow_its_regions() -> None:
    """Rectangles along and across its sides are equally tight; the cuts decide, whichever way it is turned."""
    corner = np.stack([np.cos(np.pi / 8 + np.pi / 4 * np.arange(8)), np.sin(np.pi / 8 + np.pi / 4 * np.arange(8)), np.zeros(8)], axis=1)
    faces = np.array([[0, 1, 2], [0, 2, 7], [2, 3, 4], [2, 4, 5], [2, 5, 6], [2, 6, 7]], np.int32)
    labels = np.array([0, 0, 1, 1, 1, 1], np.int32)
    for angle in (0.0, 0.3, np.pi / 4, 1.3):
        turned = rotated_about_z(Mesh(corner, faces), angle, np.zeros(3))
        low, high = plan_boxes(turned, labels, 2)
        assert sorted(np.prod(high - low, axis=1)) == pytest.approx([1, 1 + np.sqrt(2)])  # along the cut; across it 1.7 and 3.4


@pytest.mark.parametrize("mould", MOULDS, ids=lambda m: m.name)
def test_rigid_motion_about_z_leaves_opposite_sides_alone(mould: Mould) -> None:
    before = measure(mould.mesh, mould.labels)
    for angle, shift in MOTIONS:
        after = measure(rotated_about_z(mould.mesh, angle, np.array(shift)), mould.labels)
        match = matched(before, after)
        assert np.allclose(before.graph.opposite, after.graph.opposite[np.ix_(match, match)], atol=1e-6)


@pytest.mark.parametrize("mould", MOULDS, ids=lambda m: m.name)
def test_names_of_the_labels_do_not_matter(mould: Mould) -> None:
    """Other numbers for the same regions give the same tool, letter by letter."""
    numbers = np.random.default_rng(3).permutation(100)[: int(mould.labels.max()) + 1]
    renamed = np.where(mould.labels >= 0, numbers[mould.labels], -1).astype(np.int32)
    before, after = measure(mould.mesh, mould.labels), measure(mould.mesh, renamed)
    assert (before.labels == after.labels).all()
    assert [r.description for r in before.regions] == [r.description for r in after.regions]
    for field in fields(before.graph):
        assert np.array_equal(getattr(before.graph, field.name), getattr(after.graph, field.name)), field.name


@pytest.mark.parametrize("mould", MOULDS, ids=lambda m: m.name)
def test_ranges_and_descriptions(mould: Mould) -> None:
    tool = measure(mould.mesh, mould.labels)
    descriptions = [r.description for r in tool.regions]
    assert len(set(descriptions)) == tool.n
    assert not any(character.isdigit() for text in descriptions for character in text)
    assert tool.graph.area.sum() == pytest.approx(1)
    assert tool.graph.height.max() == 1
    assert tool.graph.height.min() >= 0
    assert (tool.graph.shared.sum(axis=1) <= 1 + 1e-9).all()
    assert np.array_equal(tool.graph.neighbour, tool.graph.neighbour.T)


@pytest.mark.parametrize("mould", MOULDS, ids=lambda m: m.name)
def test_sides_in_descriptions_are_where_the_region_stands(mould: Mould) -> None:
    tool = measure(mould.mesh, mould.labels)
    middle = (tool.mesh.vertices.min(axis=0) + tool.mesh.vertices.max(axis=0)) / 2
    for region in tool.regions:
        words = region.description.lower().replace(",", "").split()
        for word, axis, sign in (("left", 0, -1), ("right", 0, 1), ("front", 1, -1), ("rear", 1, 1)):
            if word in words:
                assert sign * (region.centroid[axis] - middle[axis]) > 0, f"{region.name}: {region.description}"


def test_six_rows_are_counted() -> None:
    """More rows than there are words for."""
    texts = [r.description for r in measure(*unit_grid(rows=6, columns=1)).regions]
    assert texts == [f"Floor, row {k}" for k in range(1, 7)]


def test_reading_order_of_staggered_boxes() -> None:
    """The second row begins left of the first; the tall box on the right belongs to the first by overlap."""
    low, high = np.array([[1, 2], [0, 0], [3, 1.2], [1.5, 0]]), np.array([[2, 3], [1, 1], [4, 3], [2.5, 1]])
    assert reading_order(low, high).tolist() == [0, 2, 1, 3]


def test_labels_that_name_nothing_are_refused() -> None:
    mesh, labels = unit_grid()
    with pytest.raises(InvalidInput, match="names no region"):
        measure(mesh, np.full_like(labels, -1))
    with pytest.raises(InvalidInput, match="names no region"):
        measure(mesh, labels[:-1])


@pytest.mark.parametrize(("sides", "expected"), [(4, [0, 1, 0]), (6, [0, 0, 1, 0, 0]), (3, [0, 0]), (8, [])])
@pytest.mark.parametrize("turn", [0.0, 0.3, 2.0])
def test_opposite_in_a_regular_polygon(sides: int, expected: list[float], turn: float) -> None:
    """One side is free, beyond each other one lies a triangle: only the parallel side is opposite (octagon: 45 degrees count partly)."""
    at = turn + 2 * np.pi * np.arange(sides) / sides
    inner = np.stack([np.cos(at), np.sin(at), np.zeros(sides)], axis=1)
    middle = at + np.pi / sides
    tips = 2 * np.stack([np.cos(middle), np.sin(middle), np.zeros(sides)], axis=1)
    core = [[sides * 2, k, (k + 1) % sides] for k in range(sides)]
    outside = [[k, sides + k, (k + 1) % sides] for k in range(1, sides)]
    mesh = Mesh(np.concatenate([inner, tips, np.zeros((1, 3))]), np.array(core + outside, np.int32))
    tool = measure(mesh, np.array([0] * sides + list(range(1, sides)), np.int32))
    order = [int(tool.labels[sides + k]) for k in range(sides - 1)]
    found = tool.graph.opposite[int(tool.labels[0]), order] * sides
    if sides == 8:
        # at 45 degrees a side counts partly, and has one whole and two such sides across
        partly = (np.cos(np.pi / 4) - 0.5) / (np.cos(np.pi / 6) - 0.5)
        expected = [0, 0, partly / (1 + 2 * partly), 1 / (1 + 2 * partly), partly / (1 + 2 * partly), 0, 0]
    assert found == pytest.approx(expected, abs=1e-9)


def test_opposite_counts_with_the_free_share() -> None:
    """Unit square in the middle of a column; half of its left side has a neighbour: the right neighbour counts half."""
    x, y = np.meshgrid([0.0, 1, 2, 3], [0.0, 0.5, 1], indexing="ij")
    cells = np.array([[0, -1], [1, 1], [2, 2]])
    tool = measure(*surface(np.stack([x, y, np.zeros_like(x)], -1), cells))
    at = {tuple(r.centroid[:2].round(6)): i for i, r in enumerate(tool.regions)}
    assert tool.graph.opposite[at[1.5, 0.5], at[2.5, 0.5]] == pytest.approx(0.5 / 4)
