"""The cosine-diverse sample X and the feature scale."""

import numpy as np

from app.learning.sampling import diverse_sample, feature_scale, feature_sums, random_pool
from tests.learning.made_up import problems


def test_no_two_chosen_point_the_same_way():
    """Cosines of deviations from the pool's mean stay at or under zeta for every chosen pair."""
    pool = np.random.default_rng(3).normal(size=(300, 5)) + 7
    chosen = diverse_sample(pool[0], pool, 25, 0.6)
    unit = pool[chosen] - pool.mean(axis=0)
    unit /= np.linalg.norm(unit, axis=1, keepdims=True)
    cosines = (unit @ unit.T)[np.triu_indices(len(chosen), 1)]
    assert 5 < len(chosen) <= 25
    assert cosines.max() <= 0.6 + 1e-12


def test_first_choice_is_opposite_to_the_demonstration():
    pool = np.array([[1.0, 0], [-1, 0], [0, 1], [0, -1]])
    assert diverse_sample(np.array([2.0, 0.1]), pool, 4, 0.5)[0] == 1


def test_pairs_share_their_unit_and_constants_are_flagged():
    """Opposite-edge features add up to a constant of the tool, so their sums deviate by the same amount; on these equal squares
    the border features do not vary at all."""
    tools = problems(3)
    rng = np.random.default_rng(0)
    sums = [feature_sums(p, random_pool(p, 100, rng)) for p in tools]
    scale, live = feature_scale(sums)
    assert abs(scale[2] - scale[3]) < 1e-12
    assert live == (False, False, *[True] * 11)
    frozen = [np.column_stack([s, np.full(len(s), 3.0)]) for s in sums]
    assert feature_scale(frozen)[1] == (*live, False)
    assert feature_scale(frozen)[0][-1] == 1.0
    doubled, _ = feature_scale([2 * s for s in sums])
    assert np.allclose(doubled[2:], 2 * scale[2:])
