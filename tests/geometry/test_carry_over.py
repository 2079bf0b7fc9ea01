"""Region maps between cuts of one part: what stays is found whatever its number, what was edited is told in words."""

import numpy as np
import pytest

from app.geometry import editing
from app.geometry.carry_over import map_regions, why_not
from app.geometry.line_cut import cut_along_line
from app.geometry.regions import measure_labelled
from app.geometry.slicing import split_edges
from app.geometry.tool import Mesh, Tool
from tests.geometry.test_editing import halves, mould, neighbours


def finer(tool: Tool, rng: np.random.Generator) -> Tool:
    """The same regions on a mesh with many edges split, numbered the other way round."""
    sides = np.unique(np.sort(tool.mesh.faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1), axis=0).astype(np.int64)
    chosen = sides[rng.random(len(sides)) < 0.3]
    sliced = split_edges(tool.mesh, chosen, rng.uniform(0.1, 0.9, len(chosen)))
    order = rng.permutation(len(sliced.mesh.faces))
    labels = tool.labels[sliced.source][order]
    labels = np.where(labels >= 0, tool.n - 1 - labels, -1).astype(np.int32)
    return measure_labelled(Mesh(sliced.mesh.vertices, sliced.mesh.faces[order]), labels)


@pytest.mark.parametrize("seed", range(3))
def test_regions_are_found_on_other_triangles_under_other_numbers(seed: int) -> None:
    tool = mould()
    other = finer(tool, np.random.default_rng(seed))
    there, back = map_regions(tool, other), map_regions(other, tool)
    assert there.complete
    assert back.complete
    assert there.new_of.tolist() == list(range(tool.n))[::-1]
    assert there.shared.sum() == pytest.approx(sum(r.area for r in tool.regions) + there.shared[-1].sum())
    assert np.allclose(there.shared, back.shared.T, atol=1e-3 * there.shared.sum())
    assert why_not(tool, other, there) == ""


def test_every_edit_is_told() -> None:
    tool = mould()
    a, b = neighbours(tool)
    merged = editing.merge(tool, [a, b]).tool
    found = map_regions(tool, merged)
    assert not found.complete
    assert found.new_of.tolist().count(-1) == 2
    assert why_not(tool, merged, found) == "A and B were merged into A since."
    back = map_regions(merged, tool)
    assert why_not(merged, tool, back) == "A was divided since, into A and B."
    less = editing.take_off(tool, [3]).tool
    found = map_regions(tool, less)
    assert found.new_of.tolist() == [0, 1, 2, -1, *range(3, tool.n - 1)]
    assert why_not(tool, less, found) == "D is no longer part of the working surface."
    assert why_not(less, tool, map_regions(less, tool)) == "D was added since."


def test_a_border_that_moved_a_little_is_another_region() -> None:
    """1 % of A is 0.005: a strip of 0.025 x 1 is five times that."""
    tool = halves(41)
    strip = (tool.mesh.vertices[tool.mesh.faces].mean(axis=1)[:, 0] > 0.475) & (tool.labels == 0)
    moved = editing.move_piece(tool, strip, 1).tool
    found = map_regions(tool, moved)
    assert found.new_of.tolist() == [-1, -1]
    assert why_not(tool, moved, found) == "The border of A was moved since."
    assert found.shared[0].tolist() == pytest.approx([0.475, 0.025, 0])


def test_dividing_and_merging_again_leads_back() -> None:
    """The mesh is finer than before, the regions are the same."""
    tool = mould()
    middle = tool.regions[2].centroid
    corners = tool.mesh.vertices[tool.mesh.faces[tool.labels == 2]].mean(axis=1)
    cut = cut_along_line(tool, 2, np.stack([corners[np.argmin(corners[:, 0])], middle])).tool
    assert "C was divided since" in why_not(tool, cut, map_regions(tool, cut))
    again = editing.merge(cut, [2, tool.n]).tool
    assert len(again.mesh.faces) > len(tool.mesh.faces)
    assert map_regions(tool, again).new_of.tolist() == list(range(tool.n))
