"""Comparisons on one tool: distances, what an answer does, and an exception that is found."""

import numpy as np
import pytest

from app.learning.answering import after_answer, candidates_for, next_pair, reply_of
from app.learning.generalising import Generalised, learn_generalising
from app.learning.performance_state import LearningDemonstration
from app.sequencing.comparison import kendall_tau
from app.sequencing.problem import problem_for
from tests.sequencing.graphs import grid_graph


@pytest.fixture(scope="module")
def learned() -> Generalised:
    shown = [LearningDemonstration(problem_for(grid_graph(2, 3, s), ()), (1, 0, 2, 4, 3, 5)) for s in range(1, 5)]
    return learn_generalising(shown, ("layout",), (0.1, 0.03))


def test_distances_are_kendall_distances_to_the_nearest_member(learned: Generalised):
    found = candidates_for(problem_for(grid_graph(2, 3, None), ()), learned, np.random.default_rng(0))
    assert found.probability.sum() == pytest.approx(1)
    assert any(len(members) > 1 for members in found.classes)
    for a in range(3):
        for c in range(5):
            taus = [kendall_tau(found.classes[a][0], s) for s in found.classes[c]]
            assert found.distance[a, c] == pytest.approx((1 - max(taus)) * 15 / 2)
    assert (np.diag(found.distance) == 0).all()


def test_an_answer_multiplies_by_its_likelihood(learned: Generalised):
    """Candidates on the other side lose to 2 : 98, "can't tell" changes nothing, and a pair is not asked twice."""
    found = candidates_for(problem_for(grid_graph(2, 3, 7), ()), learned, np.random.default_rng(0))
    pair = next_pair(found)
    assert pair is not None
    a, b = pair
    after = after_answer(found, pair, "left")
    near, far = (found.distance[a] < found.distance[b]), (found.distance[a] > found.distance[b])
    near[a] = far[b] = False  # who wants one of the two says so
    odds = found.probability[near].sum() / found.probability[far].sum()
    assert after.probability[near].sum() / after.probability[far].sum() == pytest.approx(odds * 49)
    assert next_pair(after) != pair
    assert np.array_equal(after_answer(found, pair, "cant_tell").probability, found.probability)
    assert after_answer(found, pair, "right_mine").probability[b] == 1


def test_an_exception_is_found_by_a_few_answers(learned: Generalised):
    """An expert who wants the third most probable order gets it."""
    found = candidates_for(problem_for(grid_graph(2, 3, 8), ()), learned, np.random.default_rng(0))
    wanted = found.classes[2]
    answers = 0
    while found.classes[found.best] != wanted or answers == 0:
        pair = next_pair(found)
        assert pair is not None
        found = after_answer(found, pair, reply_of(found.classes[pair[0]][0], found.classes[pair[1]][0], wanted))
        answers += 1
    assert answers <= 5


def test_the_scripted_expert_compares_by_the_nearest_wanted_order():
    assert reply_of((0, 1, 2), (2, 1, 0), ((0, 2, 1),)) == "left"
    assert reply_of((0, 1, 2), (2, 1, 0), ((2, 0, 1), (1, 2, 0))) == "right"
    assert reply_of((0, 1, 2), (0, 1, 2), ((1, 2, 0),)) == "equal"
    assert reply_of((0, 1, 2), (2, 1, 0), ((2, 1, 0), (1, 2, 0))) == "right_mine"


def test_a_tool_of_eighteen_regions_is_asked_about(learned: Generalised):
    """Beyond the table of all sets: an order that isn't the likeliest is found by its answers."""
    found = candidates_for(problem_for(grid_graph(3, 6, 2), ()), learned, np.random.default_rng(0))
    wanted = found.classes[3]
    for _ in range(6):
        pair = next_pair(found)
        if pair is None:  # one of those shown was the expert's own
            break
        found = after_answer(found, pair, reply_of(found.classes[pair[0]][0], found.classes[pair[1]][0], wanted))
    assert found.probability.sum() == pytest.approx(1)
    assert found.classes[found.best] == wanted
