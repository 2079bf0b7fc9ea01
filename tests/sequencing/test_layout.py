"""The layout features: hand-computed values, and what must not change them."""

from dataclasses import replace

import numpy as np
import pytest

from app.geometry.tool import RegionGraph
from app.sequencing.features import FEATURE_SETS, feature_values
from app.sequencing.layout import layout_of, layout_values
from app.sequencing.problem import SequencingProblem, all_sets
from tests.sequencing.graphs import grid_graph


def row_of_three() -> RegionGraph:
    """A, B, C in a row, level and alike, but a sharp edge that falls from B to C."""
    graph = grid_graph(1, 3, None)
    angle = np.zeros((3, 3))
    angle[1, 2], angle[2, 1] = -0.5, 0.5
    return replace(graph, angle=angle, curvature=np.zeros(3), height=np.ones(3))


def test_values_by_hand():
    """Nothing finished, then B finished: two borders; A and B are fully alike, the edge parts B and C."""
    values = layout_values(row_of_three(), np.array([[False] * 3, [False, True, False]]))
    first = dict(zip([c.key for c in FEATURE_SETS["layout"].columns], values[0].T, strict=True))
    assert first["falling_edge"] == pytest.approx([0.25, 0.25, 0.5])  # level 1/2; B is the upper side: 0; C leaves it for later: 1
    assert first["inside_first"] == pytest.approx([0.25, 0.25, 0.0])
    assert first["hub_first"] == pytest.approx([0.25, 0.5, 0.25])
    assert first["apart"].tolist() == [0, 0, 0]
    second = values[1][[0, 2]]
    assert second[0] == pytest.approx([0, 1, 1, 0.125, 0.125, 0, 1, 1, 0, 0])
    assert second[1] == pytest.approx([0, 1, 1, 0, 0.125, 0, 0, 1, 0, 0])


def test_small_differences_of_hand_typed_scores_change_nothing():
    graph = replace(row_of_three(), source="real", curvature=np.array([5.0, 6.0, 5.0]))
    flat = replace(graph, curvature=np.full(3, 5.0))
    sets = all_sets(3)
    assert np.array_equal(layout_values(graph, sets), layout_values(flat, sets))
    assert layout_of(replace(graph, curvature=np.array([5.0, 8.0, 5.0]))).alike[0, 1] == pytest.approx(0.5)


def test_renaming_and_mirroring_regions_changes_nothing():
    """Column a of the renamed tool is column order[a] of the first, whatever the names."""
    graph, order = grid_graph(2, 3, 4), np.array([2, 1, 0, 5, 4, 3])
    turned = replace(
        graph,
        **{key: getattr(graph, key)[np.ix_(order, order)] for key in ("shared", "opposite", "angle", "neighbour", "corner")},
        **{key: getattr(graph, key)[order] for key in ("curvature", "height", "area", "low", "high")},
    )
    done = np.array([[True, False, False, True, False, False]])
    assert np.allclose(layout_values(turned, done), layout_values(graph, done[:, np.argsort(order)])[:, order])


def test_a_mirror_symmetric_tool_has_mirrored_ties():
    problem = SequencingProblem(grid_graph(2, 3, None), FEATURE_SETS["layout"], ())
    assert np.allclose(problem.feature_sum((1, 0, 2, 4, 3, 5)), problem.feature_sum((1, 2, 0, 4, 5, 3)))


@pytest.mark.parametrize("source", ["mesh", "real", "synthetic"])
def test_values_stay_in_range(source: str):
    graph, sets = grid_graph(2, 4, 7, source), all_sets(8)
    values = feature_values(graph, FEATURE_SETS["layout"], sets)[~sets]
    assert values.min() >= 0
    assert values.max() <= 1
    assert (np.ptp(values, axis=0) > 0).all()
