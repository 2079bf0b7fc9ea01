"""Feature definitions against transitions worked out by hand, and what must hold for every graph."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from app.errors import UnknownFeature
from app.geometry.tool import GraphSource
from app.sequencing.features import (
    DEFAULT_INTERACTIONS,
    FEATURE_SETS,
    Interaction,
    feature_set_for,
    feature_values,
    interaction_label,
    interaction_values,
)
from app.sequencing.problem import SequencingProblem, all_sets, problem_for
from tests.sequencing.graphs import every_order, grid_graph

shapes = st.sampled_from([(1, 4), (2, 2), (2, 3), (1, 6), (2, 4)])
sources = st.sampled_from(["mesh", "real", "synthetic"])


def done_of(n: int, *members: int) -> np.ndarray:
    sets = np.zeros((1, n), np.bool_)
    sets[0, list(members)] = True
    return sets


def test_clean_transition_by_hand():
    """2 x 3 squares a b c / d e f with a and c finished, now e."""
    graph = replace(
        grid_graph(2, 3, 0),
        curvature=np.array([0.4, 0.0, 0.8, 0.0, -0.5, 0.0]), height=np.array([1.0, 0.9, 0.6, 0.2, 0.3, 0.1]), area=np.full(6, 1 / 6),
    )  # fmt: skip
    angle = np.zeros((6, 6))
    angle[4, [1, 3, 5]], angle[[1, 3, 5], 4] = (0.6, -0.3, 0.0), (-0.6, 0.3, 0.0)
    value = feature_values(replace(graph, angle=angle), FEATURE_SETS["clean"], done_of(6, 0, 2))[0, 4]
    by_hand = [0.75, 0, 0.25, 0, 1 / 3, 1 / 3, 1 / 3, abs(-0.5 - 0.6) / 2, 0.5 + (0.6 - 0.3) / 3 / math.pi / 2, 0, 0.8 - 0.3]
    assert value == pytest.approx(by_hand, abs=1e-12)


def test_clean_angle_counts_a_finished_neighbour_the_other_way():
    graph = grid_graph(1, 3, 4)
    free = feature_values(graph, FEATURE_SETS["clean"], done_of(3))[0, 1, 8]
    both = feature_values(graph, FEATURE_SETS["clean"], done_of(3, 0, 2))[0, 1, 8]
    assert free - 0.5 == pytest.approx(0.5 - both, abs=1e-12)
    assert abs(free - 0.5) > 0.01


def test_real_transition_by_hand():
    """The same grid in the authors' real definitions, a and b finished, now e (first listed neighbour b)."""
    graph = replace(grid_graph(2, 3, 0, "real"), curvature=np.array([-1, 2, 1, -3, 6, 1.0]), height=np.array([1, 0.9, 0.8, 0.6, 0.5, 0.4]))
    area = np.array([0.16, 0.16, 0.16, 0.18, 0.17, 0.17])
    angle = np.zeros((6, 6))
    angle[4, [1, 5, 3]] = np.radians([20, 7, -7])
    value = feature_values(replace(graph, area=area, angle=angle), FEATURE_SETS["authors-real"], done_of(6, 0, 1))[0, 4]
    turn = math.pi + np.radians(20 + 7 - 7) - 2 * np.radians(20)
    by_hand = [0.5, 0.25, 0.0, 0.25, 0, 0, 1 - 0.68 / 1.0, 6 - 0.5, turn, 21 * (0.95 - 0.5) + 5 / 0.5]
    assert value == pytest.approx(by_hand, abs=1e-12)


def test_real_quirks():
    """A corner wins unless the first listed neighbour is finished; the first curvature keeps its sign; a step up costs 99."""
    graph = replace(grid_graph(2, 3, 0, "real"), curvature=np.full(6, -4.0), height=np.array([0.2, 0.9, 0.8, 0.6, 0.5, 0.4]))
    columns = FEATURE_SETS["authors-real"]
    assert feature_values(graph, columns, done_of(6, 0, 3))[0, 4, 4] == 5  # edge neighbour d finished, but b is listed first
    assert feature_values(graph, columns, done_of(6, 1))[0, 4, 4] == 0
    assert feature_values(graph, columns, done_of(6, 2))[0, 3, 4] == 15
    assert feature_values(graph, columns, done_of(6))[0, 0, 4] == 15
    assert feature_values(graph, columns, done_of(6))[0, 0, 7] == -4
    assert feature_values(graph, columns, done_of(6, 0))[0, 4, 9] == pytest.approx(99 * 0.3 + 5 / 0.5)


def test_synthetic_quirks():
    """The undone set's gaps are those of the done set, only rises in curvature count, 1 / height is 0 at 0."""
    graph = replace(grid_graph(2, 3, 0, "synthetic"), area=np.ones(6), curvature=np.array([1, 0, 0, 0, 0.5, 0]))
    graph = replace(graph, height=np.array([2.0, 0, 0, 0, -1, 0]))
    columns = FEATURE_SETS["authors-synthetic"]
    value = feature_values(graph, columns, done_of(6, 0, 5))[0, 4]
    assert value[5] == value[6] == pytest.approx(1 - 2 / 6)
    assert value[7] == 0
    assert value[9] == pytest.approx((1 - -1 + -1) / 2)
    assert feature_values(graph, columns, done_of(6))[0, [0, 1], 9].tolist() == [0.5, 0]
    assert feature_values(graph, columns, done_of(6))[0, 3, 4] == 0


@given(shapes, st.integers(0, 10_000))
@settings(max_examples=30, deadline=None)
def test_clean_features_stay_between_0_and_1(shape: tuple[int, int], seed: int):
    graph = grid_graph(*shape, seed)
    rng = np.random.default_rng(seed)
    low = rng.uniform(0, 3, (graph.n, 2))  # boxes that overlap, in a unit of their own
    graph = replace(graph, low=low, high=low + rng.uniform(0, 2, (graph.n, 2)) * (rng.random((graph.n, 2)) > 0.1))
    sets = all_sets(graph.n)
    values = feature_values(graph, FEATURE_SETS["clean"], sets)[~sets]
    assert values.min() >= -1e-12
    assert values.max() <= 1 + 1e-12


def test_gaps_on_a_mesh_equal_those_of_a_table_of_the_same_grid():
    """Done: two opposite corners of 2 x 2 regions of unequal area."""
    areas = np.array([0.1, 0.2, 0.3, 0.4])
    mesh, table = (replace(grid_graph(2, 2, 1, source), area=areas) for source in ("mesh", "real"))
    for members, gap in (((0, 3), 0.5), ((1, 2), 0.5), ((0, 1), 0.0), ((0, 1, 2), 0.4), ((2,), 0.0)):
        for graph in (mesh, table):
            assert feature_values(graph, feature_set_for(graph), done_of(4, *members))[0, 0, 5] == pytest.approx(gap, abs=1e-12)


@given(shapes, st.integers(0, 10_000), sources)
@settings(max_examples=20, deadline=None)
def test_border_sums_are_constant_over_complete_sequences(shape: tuple[int, int], seed: int, source: GraphSource):
    _, sums = every_order(problem_for(grid_graph(*(shape if shape != (2, 4) else (2, 3)), seed, source)))
    assert np.ptp(sums[:, 0] + sums[:, 1]) < 1e-12
    assert np.ptp(sums[:, 2] + sums[:, 3]) < 1e-12


def test_feature_values_do_not_depend_on_what_is_evaluated_with_them():
    graph = grid_graph(2, 4, 3)
    sets = all_sets(8)
    whole = feature_values(graph, FEATURE_SETS["clean"], sets)
    assert np.abs(whole[77] - feature_values(graph, FEATURE_SETS["clean"], sets[77:78])[0]).max() < 1e-15


def test_interactions_multiply_factors():
    columns = FEATURE_SETS["clean"]
    values = np.arange(11.0)[None, :] + 1
    product = interaction_values(columns, (Interaction("height", "curvature"), Interaction("orientation", "jump")), values)
    assert product.tolist() == [[(10 + 11) * 8, 9 * 5]]


def test_names():
    clean, real = FEATURE_SETS["clean"], FEATURE_SETS["authors-real"]
    assert [len(s.columns) for s in FEATURE_SETS.values()] == [11, 10, 10, 10]
    assert [interaction_label(i, clean) for i in DEFAULT_INTERACTIONS] == ["height and curvature", "orientation and curvature"]
    assert interaction_label(Interaction("height", "gaps_left"), real) == "height and gaps left behind"
    problem = SequencingProblem(grid_graph(2, 2, 0), clean)
    assert [c.symbol for c in problem.columns[-2:]] == ["phi_int_1", "phi_int_2"]
    assert len({c.key for c in problem.columns}) == 13
    with pytest.raises(UnknownFeature, match="colour"):
        interaction_label(Interaction("colour", "height"), clean)
