"""Maximum-entropy IRL against sums over every sequence."""

import itertools

import numpy as np
import pytest

from app.errors import InvalidInput
from app.learning import maximum_entropy
from app.learning.generalising import exactness, learn_generalising
from app.learning.maximum_entropy import (
    curvatures_at,
    fit,
    in_part,
    left_out_weights,
    lessons_of,
    listed,
    settled,
    surprise,
    unit_of,
)
from app.learning.performance_state import LearningDemonstration
from app.learning.soft_program import drawn, soft_to_go
from app.sequencing.features import FEATURE_SETS
from app.sequencing.problem import SequencingProblem
from tests.sequencing.graphs import grid_graph


def demonstrated(seed: int, sequence: tuple[int, ...] = (1, 0, 2, 4, 3, 5)) -> LearningDemonstration:
    return LearningDemonstration(SequencingProblem(grid_graph(2, 3, seed), FEATURE_SETS["layout"], ()), sequence)


def test_value_and_gradient_are_those_of_every_sequence():
    """-log p and its gradient from all 720 sequences one by one."""
    d = demonstrated(1)
    (lesson,), scale, live = lessons_of([d])
    w = np.random.default_rng(0).normal(size=10)
    sums = np.array([d.problem.feature_sum(s) for s in itertools.permutations(range(6))]) / scale * np.array(live)
    p = np.exp(-sums @ w)
    value, gradient = surprise(lesson, w)
    assert value == pytest.approx(lesson.total @ w + np.log(p.sum()))
    assert gradient == pytest.approx(lesson.total - p @ sums / p.sum())


def test_curvature_is_the_covariance_of_the_feature_sums():
    d = demonstrated(2)
    (lesson,), scale, live = lessons_of([d])
    w = np.random.default_rng(1).normal(size=10) * 0.3
    sums = np.array([d.problem.feature_sum(s) for s in itertools.permutations(range(6))]) / scale * np.array(live)
    p = np.exp(-sums @ w)
    p /= p.sum()
    centred = sums - p @ sums
    assert curvatures_at([lesson], w)[0] == pytest.approx((centred * p[:, None]).T @ centred, abs=1e-6)


def test_drawn_sequences_follow_the_probabilities():
    """The most likely first region is drawn as often as its probability says, within 4 deviations."""
    (lesson,), _, _ = lessons_of([demonstrated(3)])
    _, chosen = soft_to_go(lesson.values, np.full(10, 0.5), 6)
    orders = drawn(chosen, 6, np.random.default_rng(2).random((4000, 6)))
    assert (np.sort(orders, axis=1) == np.arange(6)).all()
    first = np.bincount(orders[:, 0], minlength=6) / 4000
    assert np.abs(first - chosen[0]).max() < 4 * np.sqrt(0.25 / 4000)


def test_fit_is_a_minimum_within_its_bounds():
    """Zero gradient where free, and none that points inwards at a bound."""
    lessons, _, _ = lessons_of([demonstrated(s) for s in (1, 2, 3)])
    found = fit(lessons, 0.1, lower=np.r_[np.zeros(5), np.full(5, -np.inf)])
    slope = sum(surprise(t, found.weights)[1] for t in lessons) / 3 + 0.1 * found.weights
    free = found.weights > 1e-12
    free[5:] = True
    assert np.abs(slope[free]).max() < 1e-4
    assert (slope[~free] > -1e-6).all()


def test_left_out_weights_are_near_those_of_learning_without():
    lessons, _, _ = lessons_of([demonstrated(s, o) for s, o in ((1, (1, 0, 2, 4, 3, 5)), (2, (1, 2, 0, 4, 5, 3)), (3, (4, 3, 5, 1, 0, 2)))])
    joint = fit(lessons, 0.5)
    near = left_out_weights(lessons, joint)
    for k in range(3):
        true = fit(lessons[:k] + lessons[k + 1 :], 0.5).weights
        assert np.linalg.norm(near[k] - true) < 0.6 * np.linalg.norm(joint.weights - true)


def test_listed_transitions_teach_what_the_table_teaches(monkeypatch):
    """Exact in single precision; in part close to it: same direction, no smaller surprise than it claims by more than a twentieth."""
    shown = [demonstrated(s) for s in (1, 2, 3)]
    lessons, scale, live = lessons_of(shown)
    exact = fit(lessons, 0.1)
    monkeypatch.setattr(maximum_entropy, "TENSOR_LIMIT", 5)
    unit = unit_of(scale, live)
    part = settled(shown, lessons_of(shown)[0], unit, 0.1)
    assert in_part(part) == (0, 1, 2)
    whole = listed(shown, part, unit)
    assert in_part(whole) == ()
    found = fit(whole, 0.1)
    assert found.weights == pytest.approx(exact.weights, abs=2e-3)
    assert np.abs(found.curvatures - exact.curvatures).max() < 5e-3
    rough = fit(settled(shown, lessons_of(shown)[0], unit, 0.1), 0.1)
    cosine = rough.weights @ exact.weights / np.linalg.norm(rough.weights) / np.linalg.norm(exact.weights)
    assert cosine > 0.99
    assert rough.surprise == pytest.approx(exact.surprise, rel=0.05)


def test_sixteen_regions_are_learned_from_exactly_and_thirty_in_part():
    """No silent limit: the large tool is named as an approximation, and its recorded order is likelier than a shuffled one."""
    features = FEATURE_SETS["layout"]
    sizes = ((4, 4), (5, 6))
    shown = [LearningDemonstration(SequencingProblem(grid_graph(r, c, 1), features, ()), tuple(range(r * c))) for r, c in sizes]
    learned = learn_generalising(shown, ("layout",), (0.1,))
    assert learned.approximate == (1,)
    assert "On 1 of 2 tools (30 regions)" in exactness([16, 30], learned.approximate)
    for d in shown:
        other = tuple(int(a) for a in np.random.default_rng(0).permutation(d.problem.n))
        assert d.problem.cost(learned.policy.weights, d.sequence) < d.problem.cost(learned.policy.weights, other)


def test_tools_beyond_one_integer_are_refused():
    with pytest.raises(InvalidInput, match="at most 62 regions; one has 63"):
        lessons_of([LearningDemonstration(SequencingProblem(grid_graph(7, 9, 1), FEATURE_SETS["layout"], ()), tuple(range(63)))])
