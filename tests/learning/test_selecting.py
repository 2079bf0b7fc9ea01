"""Interactions are kept for what they predict, not for what they explain; sureness of a likelihood policy."""

from dataclasses import replace

import numpy as np
import pytest

from app.learning.generalising import learn_generalising
from app.learning.performance_state import LearningDemonstration
from app.learning.selecting import Held, InteractionTrial, Selection, left_out, select_interactions
from app.learning.sureness import sureness
from app.sequencing.features import DEFAULT_INTERACTIONS, Interaction
from app.sequencing.problem import problem_for
from app.sequencing.shortest import shortest_sequence
from tests.sequencing.graphs import grid_graph

HEIGHT, TURN = DEFAULT_INTERACTIONS


def shown(weights, interactions, count=4):
    problems = [problem_for(grid_graph(2, 3, seed), interactions) for seed in range(1, count + 1)]
    return [LearningDemonstration(p, shortest_sequence(p, weights).sequence) for p in problems]


@pytest.fixture(scope="module")
def plain():
    """An expert whose orders follow from single features."""
    return shown(np.random.default_rng(3).exponential(size=11), ())


def test_selection_is_what_leaving_one_out_says(plain):
    """Recomputed: kept exactly when more orders are predicted; whatever products the problems had before."""
    dressed = [replace(d, problem=replace(d.problem, interactions=(TURN,))) for d in plain]
    found = select_interactions(dressed, (HEIGHT,))
    (trial,) = found.trials
    assert trial.without == left_out(plain, ())
    assert trial.with_it == left_out(plain, (HEIGHT,))
    assert found.kept == ((HEIGHT,) if trial.with_it.hits > trial.without.hits else ())


def test_a_product_that_decides_is_kept():
    """An expert to whom only height times curvature matters is predicted better with that product."""
    weights = np.r_[np.full(11, 1e-3), 5.0]
    demos = shown(weights, (HEIGHT,), 6)
    found = select_interactions(demos, (HEIGHT,))
    trial = found.trials[0]
    assert trial.with_it.hits > trial.without.hits
    assert found.kept == (HEIGHT,)
    assert f"predicts {trial.with_it.hits - trial.without.hits} order" in found.words(demos[0])[0]


def test_too_few_orders_are_said_not_guessed(plain):
    found = select_interactions(plain[:3], DEFAULT_INTERACTIONS)
    assert found.kept == DEFAULT_INTERACTIONS
    assert all("counted as you suspect; it takes 4 recorded orders" in words for words in found.words(plain[0]))
    assert [row["tested"] for row in found.to_json(plain[0])] == [False, False]


def test_words_of_a_rejected_product(plain):
    trial = InteractionTrial(Interaction("height", "curvature"), False, Held(4, 0.9), Held(3, 0.8))
    (words,) = Selection((), (trial,), 5, "").words(plain[0])
    assert words == "Height and curvature together: left out, because it predicts 1 order fewer (3 of 5 with it, 4 without)."


def test_sureness_of_likelihood(plain):
    """Shares add up to 1 and mostly lie in their intervals; narrower with more evidence; same seed, same bytes."""
    found = learn_generalising(plain)
    problems = [replace(d.problem, interactions=()) for d in plain] if found.policy.features == "clean" else []
    sure = sureness(found, problems, 0.005)
    assert sum(abs(x) for x in sure.shares) == pytest.approx(1.0)
    inside = [low <= share <= high for share, (low, high) in zip(sure.shares, sure.intervals, strict=True)]
    assert sum(inside) >= 0.8 * len(inside)
    assert all(0 <= c.probability <= 1 and c.classes >= 1 and c.extra >= 0 and c.samples > 1 for c in sure.tools)
    assert sureness(found, problems, 0.005) == sure
    tighter = replace(found, fit=replace(found.fit, curvatures=100 * found.fit.curvatures))
    width = [sum(b - a for a, b in s.intervals) for s in (sure, sureness(tighter, problems, 0.005))]
    assert width[1] < width[0]
