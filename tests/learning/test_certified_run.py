"""A certified run: few questions on tools nobody demonstrated, a stop of its own, the same bytes however it is interrupted."""

import json

import numpy as np
import pytest

from app.errors import InvalidInput
from app.learning.certified_run import Memory, certified_step, start_certified
from app.learning.certified_state import CertifiedParameters, CertifiedResult, CertifiedState
from app.learning.expert import ScriptedExpert
from app.learning.pairs import look_of
from app.learning.performance_state import LearningDemonstration
from app.sequencing.shortest import shortest_sequence
from tests.learning.made_up import TRUE_WEIGHTS, demonstrations, problems
from tests.sequencing.graphs import every_order

EXPERT = ScriptedExpert(TRUE_WEIGHTS, None)
STRICT = CertifiedParameters(tolerance=1e-9, most=40)


@pytest.fixture(scope="module")
def demos():
    return demonstrations(EXPERT, problems(2))


@pytest.fixture(scope="module")
def tools():
    return problems(8)[2:]


def reply(problem, question, truth=TRUE_WEIGHTS):
    """How an expert of known weights answers."""
    best = shortest_sequence(problem, truth).cost
    left, right = (problem.cost(truth, s) <= best * (1 + 1e-9) for s in (question.left, question.right))
    return {(True, True): "equal", (True, False): "left", (False, True): "right", (False, False): "both_wrong"}[left, right]


def compare(problem, question):
    left, right = (problem.cost(TRUE_WEIGHTS, s) for s in (question.left, question.right))
    return "left" if left < right else "right"


def teach(demos, tools, parameters=STRICT, seed=1, answer=reply, memory=None, stop=99) -> tuple[CertifiedResult, dict[str, str]]:
    state, answers = start_certified(demos, tools, parameters, seed), {}
    while True:
        state = CertifiedState.from_json(json.loads(json.dumps(state.to_json())))
        result = certified_step(demos, tools, parameters, state, answers, memory)
        state = result.state
        if result.outcome != "questions" or len(answers) >= stop:
            return result, answers
        for q in result.questions:
            answers[q.fingerprint] = answer(tools[q.tool], q)


def test_stops_of_its_own_with_every_tool_right(demos, tools):
    """Tools whose order had to be shown ("both wrong") aside, no order at all is cheaper for the expert than the chosen one."""
    result, answers = teach(demos, tools)
    assert result.outcome == "converged"
    assert 0 < len(answers) <= 12
    shown = {q.tool for q in result.state.asked if answers[q.fingerprint] == "both_wrong"}
    for t, tool in enumerate(tools):
        if t not in shown:
            _, sums = every_order(tool)
            chosen = shortest_sequence(tool, result.weights).sequence
            assert tool.cost(TRUE_WEIGHTS, chosen) <= (sums @ TRUE_WEIGHTS).min() * (1 + 1e-7)
            assert result.report.tools[t].probability == 1.0
            assert result.report.tools[t].samples == 0  # no estimate
    assert len(shown) < len(tools) / 2 + 1


def test_reading_answers_as_comparisons_needs_no_showing(demos, tools):
    parameters = CertifiedParameters(tolerance=1e-9, most=60, endorse=False)
    result, answers = teach(demos, tools, parameters, answer=compare)
    assert result.outcome == "converged"
    for tool in tools:
        chosen = shortest_sequence(tool, result.weights).sequence
        assert tool.cost(TRUE_WEIGHTS, chosen) <= shortest_sequence(tool, TRUE_WEIGHTS).cost * (1 + 1e-7)
    for q in result.state.asked:
        better, worse = (q.left, q.right) if answers[q.fingerprint] == "left" else (q.right, q.left)
        assert tools[q.tool].cost(result.weights, better) <= tools[q.tool].cost(result.weights, worse) * (1 + 1e-9)


def test_a_chosen_order_is_the_cheapest_from_then_on(demos, tools):
    result, answers = teach(demos, tools)
    chosen = [(tools[q.tool], q, answers[q.fingerprint]) for q in result.state.asked if answers[q.fingerprint] != "both_wrong"]
    assert chosen
    for tool, q, answer in chosen:
        order = {"left": q.left, "right": q.right, "equal": q.left}[answer]
        assert tool.cost(result.weights, order) <= shortest_sequence(tool, result.weights).cost * (1 + 1e-9)


def test_memory_changes_nothing_but_the_time(demos, tools):
    kept = Memory.empty()
    first, answers = teach(demos, tools, memory=kept)
    second, _ = teach(demos, tools)
    assert len(kept.known) == len(answers) + 1
    assert first.weights.tobytes() == second.weights.tobytes()
    assert first.state == second.state
    assert first.report == second.report


def test_another_answer_after_the_fact_is_a_fresh_start(demos, tools):
    """Taking the first answer back and giving it again ends where nothing had happened."""
    usual, answers = teach(demos, tools)
    kept = Memory.empty()
    first = usual.state.asked[0]
    state = start_certified(demos, tools, STRICT, 1)
    asked = certified_step(demos, tools, STRICT, state, {}, kept)
    assert asked.questions[0] == first
    certified_step(demos, tools, STRICT, asked.state, {first.fingerprint: "cant_tell"}, kept)
    again = certified_step(demos, tools, STRICT, asked.state, {first.fingerprint: answers[first.fingerprint]}, kept)
    assert again.state.asked == usual.state.asked[:2]


def test_no_pair_is_shown_twice_whatever_is_answered(demos, tools):
    result, answers = teach(demos, tools, CertifiedParameters(tolerance=1e-9, most=25), answer=lambda *_: "cant_tell")
    looks = [(q.tool, look_of(q.left, q.right)) for q in result.state.asked]
    assert len(looks) == len(set(looks)) == len(answers) > 3
    assert result.outcome == "converged"
    assert "can still go more than one way" in result.message


def test_a_tool_with_two_wrong_orders_is_left_to_be_shown(demos, tools):
    result, answers = teach(demos, tools, CertifiedParameters(tolerance=1e-9, most=25), answer=lambda *_: "both_wrong")
    assert len({q.tool for q in result.state.asked}) == len(result.state.asked)
    assert set(answers.values()) == {"both_wrong"}
    assert "a recorded order there would settle it" in result.message


def test_tolerance_ends_earlier_and_states_the_risk(demos, tools):
    loose, few = teach(demos, tools, CertifiedParameters(tolerance=0.02))
    _, many = teach(demos, tools)
    assert len(few) < len(many)
    shown = {q.tool for q in loose.state.asked if few[q.fingerprint] == "both_wrong"}
    for chance, tool in zip(loose.report.tools, tools, strict=True):
        if chance.tool in shown:
            continue
        assert chance.extra <= 0.02 + 1e-8
        chosen = shortest_sequence(tool, loose.weights)
        assert tool.cost(TRUE_WEIGHTS, chosen.sequence) <= 1.05 * shortest_sequence(tool, TRUE_WEIGHTS).cost


def test_an_answer_nothing_agrees_with_is_asked_once_more_and_then_named(demos, tools):
    """The dearest order of a tool, chosen by mistake."""

    def confused(problem, question):
        costs = [problem.cost(TRUE_WEIGHTS, s) for s in (question.left, question.right)]
        return "left" if costs[0] > costs[1] else "right"

    result, answers = teach(demos, tools, CertifiedParameters(tolerance=1e-9, most=30), answer=confused)
    repeats = [q for q in result.state.asked if q.repeat]
    for q in repeats:
        assert q.fingerprint.removeprefix("again|") in answers
    assert len({q.fingerprint for q in result.state.asked}) == len(result.state.asked)
    assert all(name in answers for name in result.report.unclear)


def test_contradicting_demonstrations_end_the_run_with_their_names(demos, tools):
    orders, sums = every_order(demos[0].problem)
    spoiled = [
        LearningDemonstration(demos[0].problem, orders[int(np.argmax(sums @ TRUE_WEIGHTS))]),
        *demonstrations(EXPERT, problems(5)[1:]),
    ]
    result, _ = teach(spoiled, tools)
    assert result.outcome == "infeasible"
    assert result.contradiction is not None
    assert result.contradiction.odd == (0,)
    assert result.report.slack[0] > 0
    assert not result.report.realisable


def test_other_demonstrations_need_another_run(demos, tools):
    state = start_certified(demos, tools, STRICT, 1)
    with pytest.raises(InvalidInput, match="start a new run"):
        certified_step(demos[:1], tools, STRICT, state, {})
