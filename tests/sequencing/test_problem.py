"""Sums, costs and the checks on sequences."""

import pickle

import numpy as np
import pytest

from app.errors import IncompleteSequence, InvalidInput
from app.sequencing.problem import check_sequence, problem_for
from tests.sequencing.graphs import grid_graph, step_by_step


def test_tensor_sums_equal_steps_without_a_table():
    problem, rng = problem_for(grid_graph(2, 4, 5)), np.random.default_rng(0)
    for _ in range(5):
        order = tuple(rng.permutation(8).tolist())
        assert problem.feature_sum(order) == pytest.approx(step_by_step(problem, order), abs=1e-12)
    assert np.isnan(problem.tensor()[0b101, [0, 2]]).all()
    assert np.isfinite(problem.tensor()[0b101, [1, 3]]).all()


def test_sums_read_from_the_table_are_those_of_the_steps():
    problem = problem_for(grid_graph(2, 4, 3))
    problem.tensor()
    for order in ((), (5,), (7, 0, 3), tuple(range(8))):
        assert (problem.sums_of(order) == np.add.reduce(problem.steps_of(order))).all()


def test_large_tools_give_the_same_steps():
    problem, order = problem_for(grid_graph(3, 5, 5)), tuple(np.random.default_rng(1).permutation(15).tolist())
    assert problem.feature_sum(order) == pytest.approx(step_by_step(problem, order), abs=1e-12)


def test_cost_table_above_the_tensor_limit_agrees_with_the_sequence():
    problem, rng = problem_for(grid_graph(3, 5, 2)), np.random.default_rng(3)
    w, order = rng.normal(size=13), rng.permutation(15)
    table, state, total = problem.cost_table(w), 0, 0.0
    for a in order:
        total += table[state, a]
        state |= 1 << int(a)
    assert total == pytest.approx(problem.cost(w, order), abs=1e-10)


def test_cost_is_the_weighted_sum():
    problem = problem_for(grid_graph(2, 3, 1))
    w = np.zeros(13)
    w[4] = 2.5
    order = (0, 5, 1, 2, 3, 4)
    assert problem.cost(w, order) == pytest.approx(2.5 * problem.step_features(order)[:, 4].sum())
    assert problem.step_features(order)[:, 4].tolist() == [0, 1, 0, 0, 0, 0]


def test_pickle_leaves_the_tables_out():
    problem = problem_for(grid_graph(2, 5, 1))
    problem.tensor()
    data = pickle.dumps(problem)
    assert len(data) < 20_000
    assert np.array_equal(pickle.loads(data).tensor(), problem.tensor(), equal_nan=True)


def test_check_sequence_names_regions():
    assert check_sequence(np.array([2, 0, 1]), 3) == (2, 0, 1)
    with pytest.raises(IncompleteSequence, match="B and C missing"):
        check_sequence([0], 3)
    with pytest.raises(IncompleteSequence, match="A more than once; C missing"):
        check_sequence([0, 0, 1], 3)
    with pytest.raises(IncompleteSequence, match="number 7"):
        check_sequence([0, 7, 1], 3)


@pytest.mark.parametrize("weights", [np.ones(4), np.full(13, np.nan)])
def test_bad_weights_are_refused(weights: np.ndarray):
    with pytest.raises(InvalidInput, match="13 finite weights"):
        problem_for(grid_graph(2, 2, 1)).cost(weights, (0, 1, 2, 3))
