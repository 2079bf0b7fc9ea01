"""Edits by hand: what they divide, what they leave alone, and that any series of them keeps the regions connected."""

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st

from app.errors import InvalidInput
from app.geometry import editing
from app.geometry.cleaning import face_pairs
from app.geometry.editing import Edited
from app.geometry.line_cut import cut_along_line, draw_line
from app.geometry.moulds import sample_moulds
from app.geometry.regions import measure
from app.geometry.splitting import connected
from app.geometry.tool import Tool
from tests.geometry.test_geodesic import flat, sheet


def mould(name: str = "Bend 01") -> Tool:
    found = next(m for m in sample_moulds() if m.name == name)
    return measure(found.mesh, found.labels)


def halves(n: int = 21) -> Tool:
    """The unit square as a left region A and a right one B."""
    mesh = sheet(n, flat)
    return measure(mesh, (mesh.vertices[mesh.faces].mean(axis=1)[:, 0] > 0.5).astype(np.int32))


def names(tool: Tool) -> list[str]:
    return [region.name for region in tool.regions]


def neighbours(tool: Tool) -> tuple[int, int]:
    a, b = np.argwhere(tool.graph.neighbour)[0]
    return int(a), int(b)


def check(before: Tool, edited: Edited) -> None:
    """Labels are a partition of the working surface into connected regions; nothing was lost; a solid stays closed."""
    tool = edited.tool
    labels = tool.labels
    assert sorted(set(labels[labels >= 0].tolist())) == list(range(tool.n))
    pieces = connected(labels, face_pairs(tool.mesh.faces))
    assert all(len(np.unique(pieces[labels == a])) == 1 for a in range(tool.n)), "a region is torn"
    assert len(set(names(tool))) == tool.n
    one, other = (trimesh.Trimesh(t.mesh.vertices, t.mesh.faces, process=False) for t in (before, tool))
    assert other.area == pytest.approx(one.area, rel=1e-9)
    assert other.is_watertight == one.is_watertight
    for new, old in enumerate(edited.kept):
        if old >= 0:
            assert tool.regions[new].name == before.regions[old].name
            assert tool.regions[new].area == pytest.approx(before.regions[old].area, rel=1e-9)
    assert set(edited.changed) == set(range(before.n)) - set(edited.kept.tolist())


def test_merging_keeps_the_name_of_the_largest() -> None:
    tool = mould()
    a, b = neighbours(tool)
    edited = editing.merge(tool, [a, b])
    check(tool, edited)
    larger = max((a, b), key=lambda region: tool.regions[region].area)
    merged = names(edited.tool).index(tool.regions[larger].name)
    assert edited.tool.regions[merged].area == pytest.approx(tool.regions[a].area + tool.regions[b].area)
    assert edited.changed == (a, b)
    assert edited.tool.n == tool.n - 1


def test_regions_apart_are_not_merged() -> None:
    tool = mould()
    apart = next(b for b in range(1, tool.n) if not tool.graph.neighbour[0, b])
    with pytest.raises(InvalidInput, match=f"A and {tool.regions[apart].name} don't touch"):
        editing.merge(tool, [0, apart])
    with pytest.raises(InvalidInput, match="two or more"):
        editing.merge(tool, [3, 3])


def test_plane_divides_where_it_was_put() -> None:
    """A is 0.5 x 1; a plane across it at y = 0.3 leaves 0.15 and 0.35, and B as it was."""
    tool = halves()
    edited = editing.split_by_plane(tool, 0, np.array([0.2, 0.3, 0.0]), np.array([0.0, 2.0, 0.0]))
    check(tool, edited)
    assert [r.area for r in edited.tool.regions] == pytest.approx([0.35, 0.5, 0.15])
    assert names(edited.tool) == ["A", "B", "C"]
    assert edited.kept.tolist() == [-1, 1, -1]


def test_upright_plane_holds_both_points_and_the_surface_normal() -> None:
    tool = halves()
    normal = editing.upright_plane(tool, 0, np.array([0.1, 0.2, 0.0]), np.array([0.3, 0.6, 0.0]))
    assert normal @ [0.2, 0.4, 0] == pytest.approx(0)
    assert normal @ [0, 0, 1.0] == pytest.approx(0)
    assert np.linalg.norm(normal) > 0


@pytest.mark.parametrize("normal", [[0.0, 0, 0], [1.0, 0, 0]])
def test_plane_that_does_not_divide(normal: list[float]) -> None:
    with pytest.raises(InvalidInput, match=r"no direction|doesn't divide A"):
        editing.split_by_plane(halves(), 0, np.array([2.0, 0, 0]), np.array(normal))


def test_line_runs_on_to_the_borders() -> None:
    """Clicks at (0.1, 0.1) and (0.4, 0.35) in A: the line goes on to x = 0 or y = 0 and to x = 0.5."""
    tool = halves()
    edited = cut_along_line(tool, 0, np.array([[0.1, 0.12, 0.0], [0.42, 0.33, 0.0]]))
    check(tool, edited)
    line = draw_line(tool, 0, np.array([[0.1, 0.12, 0.0], [0.42, 0.33, 0.0]]))
    assert min(line.points[0][:2]) == pytest.approx(0, abs=1e-6)
    assert line.points[-1][0] == pytest.approx(0.5, abs=1e-6)
    parts = sorted(edited.tool.regions[i].area for i in (0, 2))
    # from (0, 0.12): a trapezoid under the line, then level to the border
    assert parts[0] == pytest.approx(0.1 * 0.12 + 0.32 * (0.12 + 0.33) / 2 + 0.08 * 0.33, rel=0.02)
    assert sum(parts) == pytest.approx(0.5)


def test_closed_line_cuts_out_an_island() -> None:
    tool = halves()
    square = np.array([[0.1, 0.3, 0], [0.4, 0.3, 0], [0.4, 0.7, 0], [0.1, 0.7, 0]])
    edited = cut_along_line(tool, 0, square, closed=True)
    check(tool, edited)
    assert edited.tool.regions[2].area == pytest.approx(0.12, rel=0.01)


def test_line_off_its_region_or_too_short() -> None:
    tool = halves()
    with pytest.raises(InvalidInput, match="doesn't lie on A"):
        cut_along_line(tool, 0, np.array([[0.1, 0.1, 0.0], [0.9, 0.1, 0.0]]))
    with pytest.raises(InvalidInput, match="one place"):
        cut_along_line(tool, 0, np.array([[0.1, 0.1, 0.0], [0.1, 0.1, 0.0]]))
    with pytest.raises(InvalidInput, match="2 to 100"):
        cut_along_line(tool, 0, np.array([[0.1, 0.1, 0.0]]))


def test_piece_moves_to_the_neighbour_or_stands_alone() -> None:
    tool = halves()
    centres = tool.mesh.vertices[tool.mesh.faces].mean(axis=1)
    strip = (tool.labels == 0) & (centres[:, 0] > 0.4)
    assert editing.best_neighbour(tool, strip) == 1
    moved = editing.move_piece(tool, strip, 1)
    check(tool, moved)
    assert [r.area for r in moved.tool.regions] == pytest.approx([0.4, 0.6])
    alone = editing.move_piece(tool, strip, None)
    check(tool, alone)
    assert [r.area for r in alone.tool.regions] == pytest.approx([0.4, 0.5, 0.1])
    with pytest.raises(InvalidInput, match="no border with B"):
        editing.move_piece(tool, (tool.labels == 0) & (centres[:, 0] < 0.1), 1)


def test_moving_the_middle_tears_a_region_in_two() -> None:
    """What is torn off becomes a region of its own; the largest piece keeps number and name."""
    tool = halves()
    centres = tool.mesh.vertices[tool.mesh.faces].mean(axis=1)
    edited = editing.move_piece(tool, (tool.labels == 0) & (centres[:, 1] > 0.2) & (centres[:, 1] < 0.4), 1)
    check(tool, edited)
    assert [r.area for r in edited.tool.regions] == pytest.approx([0.3, 0.6, 0.1])


def test_working_surface_off_and_on_again() -> None:
    tool = mould()
    off = editing.take_off(tool, [4])
    check(tool, off)
    assert off.tool.n == tool.n - 1
    assert "E" not in names(off.tool)
    on = editing.add_patch(off.tool, tool.labels == 4)
    check(off.tool, on)
    assert names(on.tool)[-1] == "E", "the lowest free letter"
    assert on.tool.regions[-1].area == pytest.approx(tool.regions[4].area)
    with pytest.raises(InvalidInput, match="one region at least"):
        editing.take_off(tool, range(tool.n))


@settings(max_examples=15, deadline=None)
@given(st.integers(0, 2**31), st.sampled_from(["Bend 01", "Barrel 02", "Step 03"]))
def test_any_series_of_edits_keeps_connected_regions(seed: int, name: str) -> None:
    rng = np.random.default_rng(seed)
    tool = mould(name)
    for _ in range(5):
        try:
            edited = random_edit(tool, rng)
        except InvalidInput:
            continue
        check(tool, edited)
        tool = edited.tool


def random_edit(tool: Tool, rng: np.random.Generator) -> Edited:
    region = int(rng.integers(tool.n))
    inside = np.flatnonzero(tool.labels == region)
    corners = tool.mesh.vertices[tool.mesh.faces[rng.choice(inside, 3)]]
    points = np.einsum("kc,kci->ki", rng.dirichlet(np.ones(3), 3), corners)
    match int(rng.integers(6)):
        case 0:
            return editing.merge(tool, neighbours(tool))
        case 1:
            return editing.split_by_plane(tool, region, points[0], rng.normal(size=3))
        case 2:
            return cut_along_line(tool, region, points[:2])
        case 3:
            return cut_along_line(tool, region, points, closed=True)
        case 4:
            near = np.argsort(np.linalg.norm(tool.mesh.vertices[tool.mesh.faces].mean(axis=1) - points[0], axis=1))[:20]
            piece = np.isin(np.arange(len(tool.labels)), near) & (tool.labels == region)
            return editing.move_piece(tool, piece, editing.best_neighbour(tool, piece))
        case _:
            return editing.take_off(tool, [region])
