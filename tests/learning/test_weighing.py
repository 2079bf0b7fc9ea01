"""Answers weighed against each other inside the weights that explain the demonstrations."""

import numpy as np
import pytest

from app.learning.certified_run import certified_step, start_certified
from app.learning.certified_state import CertifiedParameters
from app.learning.expert import ScriptedExpert
from app.learning.pairs import REPEAT, PairQuestion
from app.learning.weighing import repeats_of
from app.sequencing.shortest import shortest_sequence
from tests.learning.made_up import TRUE_WEIGHTS, demonstrations, problems
from tests.learning.test_certified_run import reply

EXPERT = ScriptedExpert(TRUE_WEIGHTS, None)
DEMOS, TOOLS = demonstrations(EXPERT, problems(2)), problems(8)[2:]
CHECKED = CertifiedParameters(tolerance=1e-9, most=12, check=2)
OTHER = {"left": "right", "right": "left", "both_wrong": "left"}


def taught(answer):
    state, answers = start_certified(DEMOS, TOOLS, CHECKED, 1), {}
    while True:
        result = certified_step(DEMOS, TOOLS, CHECKED, state, answers)
        state = result.state
        if result.outcome != "questions":
            return result, answers
        for q in result.questions:
            answers[q.fingerprint] = answer(TOOLS[q.tool], q)


def test_a_steady_expert_is_asked_again_and_nothing_is_weighed():
    """Every second answer one comes again with its sides exchanged, and is answered the same."""
    result, _ = taught(reply)
    first = {q.fingerprint: q for q in result.state.asked}
    again = [q for q in result.state.asked if q.repeat]
    assert len(again) >= 1
    for q in again:
        before = first[q.fingerprint.removeprefix(REPEAT)]
        assert (q.left, q.right) == (before.right, before.left)
    report = result.report
    assert (report.repeated_alike, report.weighed, report.unclear) == (report.repeated, False, ())


def test_a_slip_is_named_and_outvoted():
    """The first choice is wrong, and right when asked again: it sits ill, demonstrations stay exact, most tools come out right."""
    slips: list[str] = []

    def slipping(problem, question):
        said = reply(problem, question)
        if not slips and said in ("left", "right"):
            slips.append(question.fingerprint)
            return OTHER[said]
        return said

    result, answers = taught(slipping)
    assert REPEAT + slips[0] in answers  # the check found it
    assert result.outcome == "converged"
    report = result.report
    assert report.weighed
    assert report.repeated_alike == report.repeated - 1
    assert slips[0] in report.unclear
    assert "weighed against each other" in result.message
    assert all(s == 0 for s in report.slack)
    for d in DEMOS:
        assert d.problem.cost(result.weights, d.sequence) <= shortest_sequence(d.problem, result.weights).cost * (1 + 1e-7)


def test_repeats_match_their_sides():
    q = PairQuestion(0, (0, 1), (1, 0), "", (0, 1), "a")
    same = PairQuestion(0, (0, 1), (1, 0), "", (0, 1), REPEAT + "a", repeat=True)
    exchanged = PairQuestion(0, (1, 0), (0, 1), "", (0, 1), REPEAT + "a", repeat=True)
    assert repeats_of([q, same], {"a": "left", REPEAT + "a": "left"}).pairs == (("left", "left"),)
    assert repeats_of([q, exchanged], {"a": "left", REPEAT + "a": "right"}).alike == 1
    assert repeats_of([q, exchanged], {"a": "left", REPEAT + "a": "left"}).changed == ("a",)
    assert repeats_of([q, exchanged], {"a": "left", REPEAT + "a": "cant_tell"}).reliability is None
    assert repeats_of([q, exchanged], {"a": "equal", REPEAT + "a": "equal"}).reliability == pytest.approx(0.5 * (1 + np.sqrt(1 / 3)))
