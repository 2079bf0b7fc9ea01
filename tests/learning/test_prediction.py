"""A policy on a tool, the scripted expert, and differences in words."""

import itertools
from dataclasses import replace

import numpy as np
import pytest

from app.errors import StalePolicy
from app.learning.differences import describe_difference
from app.learning.effort_features import effort_penalty
from app.learning.expert import ScriptedExpert
from app.learning.policy import Policy
from app.learning.prediction import predict
from app.sequencing.classes import optimal_sequences
from app.sequencing.features import DEFAULT_INTERACTIONS
from app.sequencing.problem import problem_for
from tests.learning.made_up import TRUE_WEIGHTS
from tests.sequencing.graphs import every_order, grid_graph

EFFORT = np.array([0.5, 0, 0.2, 0, 0, 0.1, 0, 0])
POLICY = Policy(TRUE_WEIGHTS, "clean", 1, DEFAULT_INTERACTIONS, EFFORT, (True,) * 13)


def test_prediction_is_cheapest_then_least_effort():
    """Against every order of a symmetric six-region tool: no order is cheaper, and none as cheap has less effort."""
    problem = problem_for(grid_graph(2, 3, None))
    prediction = predict(problem, POLICY)
    orders, sums = every_order(problem)
    costs = sums @ TRUE_WEIGHTS
    ties = [o for o, c in zip(orders, costs, strict=True) if c <= costs.min() * (1 + 1e-9)]
    assert prediction.cost == pytest.approx(costs.min())
    assert prediction.ties == len(ties) > 1
    assert prediction.effort == pytest.approx(min(effort_penalty(problem, EFFORT, o) for o in ties))
    assert prediction.step_parts.sum() == pytest.approx(prediction.cost)
    assert prediction.step_parts.shape == (6, 13) == (6, len(prediction.labels))
    assert prediction.proved
    assert prediction.tie_settled_by == "least effort at start and end"


def test_without_effort_nothing_is_claimed():
    prediction = predict(problem_for(grid_graph(2, 3, None)), replace(POLICY, effort_weights=None))
    assert prediction.effort is None
    assert "no effort" in (prediction.tie_settled_by or "")


@pytest.mark.parametrize("change", [{"features": "authors-real"}, {"version": 2}, {"interactions": ()}])
def test_foreign_policy_is_refused(change):
    with pytest.raises(StalePolicy):
        predict(problem_for(grid_graph(2, 3, 1)), replace(POLICY, **change))


def test_scripted_expert_answers_by_its_weights():
    problem = problem_for(grid_graph(2, 3, None))
    expert = ScriptedExpert(TRUE_WEIGHTS, EFFORT)
    best = expert.sequence(problem)
    equal = [s for s in optimal_sequences(problem, TRUE_WEIGHTS).sequences if s != best]
    dear = max(every_order(problem)[0], key=lambda s: problem.cost(TRUE_WEIGHTS, s))
    assert equal
    assert {expert.similar(problem, best, s) for s in equal} == {"similar"}
    assert expert.similar(problem, best, dear) == "not_similar"
    assert expert.similar(problem, dear, best) == "similar"  # better than demonstrated is just as good
    assert {expert.prefers(problem, best, s) for s in equal} <= {"left", "equal"}
    assert "left" in {expert.prefers(problem, best, s) for s in equal}
    assert ScriptedExpert(None, None).similar(problem, best, dear) == "not_similar"
    assert ScriptedExpert(None, None).prefers(problem, best, dear) == "equal"


NAMES, DESCRIPTIONS = ("A", "B", "C", "D"), ("Floor", "Left wall", "", "Rim")


@pytest.mark.parametrize(
    ("left", "right", "text"),
    [
        ((0, 1, 2, 3), (0, 1, 2, 3), "Both orders are the same."),
        ((0, 1, 2, 3), (3, 2, 1, 0), "The other is your order backwards: it starts with D (rim) and ends with A (floor)."),
        ((0, 1, 2, 3), (1, 0, 2, 3), "Yours does A (floor) before B (left wall), the other the reverse; all else is the same."),
        (
            (0, 1, 2, 3),
            (2, 0, 3, 1),
            "Yours does A (floor) before C; the other starts with C and ends with B (left wall). All 4 regions come at another step.",
        ),
        (
            (0, 1, 2, 3),
            (0, 3, 1, 2),
            "Yours does B (left wall) before D (rim); the other does D (rim) second and ends with C. 3 of 4 regions come at another step.",
        ),
    ],
)
def test_differences_in_words(left, right, text):
    assert describe_difference(NAMES, DESCRIPTIONS, left, right) == text


def test_too_many_regions_come_with_a_bound_that_patience_only_improves():
    problem = problem_for(grid_graph(5, 6, 3))
    asked = itertools.count()
    hasty, patient = (predict(problem, POLICY, should_stop=lambda most=most: next(asked) >= most) for most in (0, 150))
    assert not patient.proved
    assert hasty.sequence == patient.sequence
    assert 0 < hasty.bound < patient.bound < patient.cost
    assert patient.gap == pytest.approx((patient.cost - patient.bound) / patient.cost)
    assert patient.gap < 0.3
