"""Algorithm 2 and Eq. 8: start and end features, learning from preferences, contradictions named."""

import json

import numpy as np
import pytest

from app.errors import EmptySample
from app.learning.effort import EffortParameters, EffortState, _Answered, _fit, _smallest_conflict, effort_step, fit_pooled, start_effort
from app.learning.effort_features import EFFORT_COLUMNS, all_effort_features, effort_features, effort_penalty
from app.learning.expert import ScriptedExpert
from app.learning.performance import LearningDemonstration
from app.sequencing.classes import optimal_sequences
from app.sequencing.problem import problem_for
from tests.sequencing.graphs import grid_graph

WEIGHTS = np.array([0.4, 0.4, 0.3, 0.3, 1.5, 0.6, 0.9, 1.2, 0.5, 2.0, 0.7, 0.3, 0.4])
START_RIGHT_COSTS = np.array([1.0, 0, 0, 0, 0, 0, 0, 0])  # an expert who stands on the left
PARAMETERS = EffortParameters()


@pytest.fixture(scope="module")
def demos():
    """Mirror-symmetric tools, so that equivalent orders start on either side."""
    tools = [problem_for(grid_graph(2, 4, None)), problem_for(grid_graph(3, 3, None))]
    expert = ScriptedExpert(WEIGHTS, START_RIGHT_COSTS)
    return [LearningDemonstration(p, expert.sequence(p)) for p in tools]


def teach(demos, expert, parameters=PARAMETERS):
    answers: dict[str, str] = {}
    state = start_effort(demos, WEIGHTS, parameters, 0)
    while True:
        state = EffortState.from_json(json.loads(json.dumps(state.to_json())))
        result = effort_step(demos, parameters, state, answers)
        state = result.state
        for q in result.questions:
            answers[q.fingerprint] = expert.prefers(demos[q.demonstration].problem, q.left, q.right)
        if result.outcome != "questions":
            return result, answers


def test_features_of_corners():
    """Start at region 0 (left, front), end at the opposite corner: (x, 1 - x, y, 1 - y) = (0, 1, 0, 1), then (1, 0, 1, 0)."""
    problem = problem_for(grid_graph(2, 3, 1))
    assert effort_features(problem, (0, 1, 2, 3, 4, 5)).tolist() == [0, 1, 0, 1, 1, 0, 1, 0]
    assert len(EFFORT_COLUMNS) == 8


def test_real_tables_have_columns_as_x():
    """Region 1 of a real 2 x 3 grid is stored as (row, column); with swapped axes x is the grid's first coordinate."""
    graph = grid_graph(2, 3, 1, "real")
    plain = effort_features(problem_for(grid_graph(2, 3, 1)), (1, 0, 2, 3, 4, 5))
    swapped = effort_features(problem_for(graph), (1, 0, 2, 3, 4, 5))
    assert plain[:4].tolist() == [0.5, 0.5, 0, 1]
    assert swapped[:4].tolist() == [0, 1, 0.5, 0.5]


def test_start_side_preference_is_recovered(demos):
    """The learned penalty orders every pair of equally cheap sequences as the expert does whenever the expert has a preference."""
    expert = ScriptedExpert(WEIGHTS, START_RIGHT_COSTS)
    result, answers = teach(demos, expert)
    assert result.outcome == "converged"
    assert 0 < len(answers) <= PARAMETERS.most
    checked = 0
    for d in demos:
        own = optimal_sequences(d.problem, WEIGHTS).sequences
        for a in own:
            for b in own:
                if START_RIGHT_COSTS @ (effort_features(d.problem, b) - effort_features(d.problem, a)) > 1e-9:
                    checked += 1
                    assert effort_penalty(d.problem, result.effort_weights, a) < effort_penalty(d.problem, result.effort_weights, b)
    assert checked >= 8


def test_no_preference_means_no_effort(demos):
    """psi is empty: eta is 0."""
    result, answers = teach(demos, ScriptedExpert(WEIGHTS, None))
    assert answers
    assert not result.effort_weights.any()
    assert result.outcome == "converged"


def test_equal_and_cant_tell_are_not_asked_again(demos):
    parameters = EffortParameters(most=100)
    answers: dict[str, str] = {}
    state = start_effort(demos, WEIGHTS, parameters, 0)
    for _ in range(100):
        result = effort_step(demos, parameters, state, answers)
        state = result.state
        assert not {q.fingerprint for q in result.questions} & set(answers)
        answers |= {q.fingerprint: "cant_tell" for q in result.questions}
        if result.outcome == "converged":
            break
    assert result.outcome == "converged"
    assert len({q.fingerprint for q in state.asked}) == len(state.asked)


def row(name, difference, value="left"):
    return _Answered(name, np.array([*difference, *[0.0] * (8 - len(difference))]), value, np.zeros(8))


def test_margin_by_hand():
    """One answer w . (1, -1) >= 0.1 with w >= 0: the least-norm solution is (0.1, 0)."""
    w = _fit([row("a", [1, -1])], EffortParameters(margin=0.1, regularisation=0.01))
    assert w == pytest.approx([0.1, *[0] * 7], abs=1e-5)
    assert not w[1:].any()


def test_contradiction_is_named_and_minimal(demos):
    """'Right is worse than left' and its opposite exclude each other; the two answers about something else are not blamed."""
    known = [row("up", [0, 0, 1, -1]), row("a", [1, -1]), row("far", [0, 0, 0, 0, 1, -1]), row("b", [1, -1], "right")]
    assert _smallest_conflict(known) == ("a", "b")
    assert _smallest_conflict(known[:3]) == ()
    assert np.isfinite(_fit(known, PARAMETERS)).all()


def test_cycle_of_three_is_minimal():
    known = [row("a", [1, 0, 0]), row("b", [-1, 1, 0]), row("c", [0, -1, 0]), row("d", [0, 0, 1])]
    assert set(_smallest_conflict(known)) == {"c"} or set(_smallest_conflict(known)) == {"a", "b", "c"}
    for left_out in _smallest_conflict(known):
        assert _smallest_conflict([a for a in known if a.fingerprint != left_out]) == ()


def test_contradicting_answers_end_as_infeasible(demos):
    """Each pair of mirrored questions answered the same way: the expert can't mean both."""
    parameters = EffortParameters(batch=12)
    state = start_effort(demos, WEIGHTS, parameters, 0)
    first = effort_step(demos, parameters, state, {})
    conflict = None
    for value in ("left", "right"):
        for other in first.questions:
            answers = {q.fingerprint: value for q in first.questions} | {other.fingerprint: "right" if value == "left" else "left"}
            result = effort_step(demos, parameters, first.state, answers)
            if result.outcome == "infeasible":
                conflict = result
    assert conflict is not None
    assert conflict.conflicts
    assert "exclude each other" in conflict.message


def test_nothing_recorded_is_refused():
    with pytest.raises(EmptySample):
        start_effort([], WEIGHTS, PARAMETERS, 0)


@pytest.mark.parametrize("column", range(8))
def test_a_preferred_side_is_found_in_five_answers(demos, column):
    """Start or end, any side: after at most five answers every pair of the expert's equally cheap orders is ranked as the expert does."""
    expert = ScriptedExpert(WEIGHTS, np.eye(8)[column])
    result, answers = teach(demos, expert, EffortParameters(most=5))
    assert len(answers) <= 5
    for d in demos:
        own = optimal_sequences(d.problem, WEIGHTS).sequences
        z = np.array([effort_features(d.problem, s) for s in own])
        gap = (z[:, None] - z[None]) @ np.eye(8)[column]
        learned = (z[:, None] - z[None]) @ result.effort_weights
        assert (learned[gap > 1e-9] > 0).all()


def test_pooled_threshold_satisfies_the_optimality_conditions():
    """Eq. 8 as printed: no feasible step lowers the objective, and what can be separated is separated by the margin."""
    rng, parameters = np.random.default_rng(1), EffortParameters(pooled=True)
    truth = np.array([2.0, 0, 1, 0, 0, 0.5, 0, 0])
    z = rng.random((30, 8))
    eta = z @ truth
    better, worse = z[eta < np.median(eta) - 0.15], z[eta > np.median(eta) + 0.15]
    w = fit_pooled(better, worse, parameters)
    assert (worse @ w).min() - (better @ w).max() >= parameters.margin - 1e-6

    def objective(x):
        slack = np.maximum(0.0, (better @ x).max() + parameters.margin - worse @ x)
        return 0.5 * parameters.regularisation * float(x @ x) + float(slack.sum())

    for _ in range(300):
        step = rng.normal(size=8) * 10 ** rng.uniform(-4, 0)
        assert objective(np.maximum(w + step, 0.0)) >= objective(w) - 1e-7
    assert not fit_pooled(better, worse[:0], parameters).any()  # nothing unpreferred: no penalty


def test_travel_and_side_changes_by_hand():
    """2 x 3 grid, centres 0, .5, 1 by 0, 1: row by row goes .5, .5, then back over (1, 1); as a snake the way is shorter."""
    problem = problem_for(grid_graph(2, 3, 1))
    way = (4 * 0.5 + np.sqrt(2)) / (5 * np.sqrt(2))
    z = all_effort_features(problem, (0, 1, 2, 3, 4, 5))
    assert z[8:] == pytest.approx([way, 3 / 5])  # left, middle, right | left, middle, right
    snake = all_effort_features(problem, (0, 1, 2, 5, 4, 3))
    assert snake[8:] == pytest.approx([(4 * 0.5 + 1) / (5 * np.sqrt(2)), 2 / 5])
    assert effort_penalty(problem, np.r_[np.zeros(8), 2.0, 1.0], (0, 1, 2, 3, 4, 5)) == pytest.approx(2 * way + 3 / 5)


@pytest.mark.parametrize("column", [8, 9])
def test_shorter_ways_and_fewer_changes_of_side_are_learned_when_switched_on(demos, column):
    """The settled order of each tool has the least effort to the expert, among all equally cheap ones; off by default."""
    wish = np.eye(10)[column]
    expert = ScriptedExpert(WEIGHTS, wish)
    plain, answers = teach(demos, expert)
    assert len(plain.effort_weights) == 8
    result, answers = teach(demos, expert, EffortParameters(travel=True, side_changes=True))
    assert len(answers) <= EffortParameters().most
    for d in demos:
        own = optimal_sequences(d.problem, WEIGHTS).sequences
        chosen = min(own, key=lambda s: (effort_penalty(d.problem, result.effort_weights, s), s))
        assert effort_penalty(d.problem, wish, chosen) == pytest.approx(min(effort_penalty(d.problem, wish, s) for s in own))
