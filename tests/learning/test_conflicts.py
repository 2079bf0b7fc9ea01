"""Minimal sets of demonstrations that contradict each other, and what would resolve them."""

import numpy as np
import pytest

from app.learning.certified import CertifiedPrior, certify, pool_for
from app.learning.conflicts import conflict_words, conflicts, realisable
from app.learning.expert import ScriptedExpert
from app.learning.performance_state import LearningDemonstration
from app.sequencing.features import DEFAULT_INTERACTIONS, Interaction
from app.sequencing.problem import problem_for
from tests.learning.made_up import TRUE_WEIGHTS, demonstrations, problems
from tests.sequencing.graphs import every_order, grid_graph

EXPERT = ScriptedExpert(TRUE_WEIGHTS, None)


@pytest.fixture(scope="module")
def spoiled():
    """The first tool is shown in its dearest order."""
    demos = demonstrations(EXPERT, problems(5))
    orders, sums = every_order(demos[0].problem)
    return [LearningDemonstration(demos[0].problem, orders[int(np.argmax(sums @ TRUE_WEIGHTS))]), *demos[1:]]


def test_sets_are_minimal(spoiled):
    """Together they can't be explained; without any one of them the rest can."""
    found = conflicts(spoiled)
    assert found
    prior = CertifiedPrior()
    for conflict in found:
        assert not realisable(pool_for(spoiled, prior, ()), conflict.members, prior)
        for i in conflict.members:
            rest = [k for k in conflict.members if k != i]
            assert not rest or realisable(pool_for(spoiled, prior, ()), rest, prior)
        assert all(s > 0 for s in conflict.slack)


def test_what_is_left_after_all_sets_fits(spoiled):
    found = conflicts(spoiled)
    dropped = {c.members[int(np.argmin(c.slack))] for c in found}
    assert certify([d for i, d in enumerate(spoiled) if i not in dropped]).realisable


def test_consistent_demonstrations_have_none():
    assert conflicts(demonstrations(EXPERT, problems(4))) == ()


def test_a_missing_sign_is_found():
    """An expert who likes steps up: letting that weight be negative resolves the contradiction."""
    likes = TRUE_WEIGHTS.copy()
    likes[9] = -6.0
    found = conflicts(demonstrations(ScriptedExpert(likes, None), problems(12)))
    assert found
    assert all(9 in c.resolved_by_sign for c in found)
    words = conflict_words(found[0], [f"Tool {i}" for i in range(12)], problems(1)[0])
    assert "could be negative" in words
    assert "%" in words


def test_a_missing_interaction_is_found():
    """The expert weighs the product of height and curvature above all; without that column the orders contradict."""
    truth = np.concatenate([0.05 * TRUE_WEIGHTS[:11], [8.0]])
    product = Interaction("height", "curvature")
    full = [problem_for(grid_graph(2, 3, seed), (product,)) for seed in range(1, 13)]
    shown = [ScriptedExpert(truth, None).sequence(p) for p in full]
    demos = [LearningDemonstration(problem_for(grid_graph(2, 3, seed), ()), s) for seed, s in zip(range(1, 13), shown, strict=True)]
    found = conflicts(demos, suspects=DEFAULT_INTERACTIONS)
    assert found
    assert all(product in c.resolved_by_interaction for c in found)
