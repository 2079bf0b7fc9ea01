"""Questions about one tool: at most three, and an end that follows the answers."""

import numpy as np
import pytest

from app.learning.answering import Candidates, candidates_for, reply_of
from app.learning.exception_run import ExceptionMemory, ExceptionParameters, ExceptionResult, ExceptionState, exception_step
from app.learning.generalising import learn_generalising
from app.learning.performance_state import LearningDemonstration
from app.sequencing.problem import SequencingProblem, problem_for
from tests.sequencing.graphs import grid_graph

Answer = str | tuple[tuple[int, ...], ...]  # the same to everything, or the orders that are wanted
Lesson = tuple[list[LearningDemonstration], SequencingProblem, Candidates]


@pytest.fixture(scope="module")
def lesson() -> Lesson:
    """Four recorded tools, a doubted one, and the orders that come into question on it."""
    shown = [LearningDemonstration(problem_for(grid_graph(2, 3, s), ()), (1, 0, 2, 4, 3, 5)) for s in range(1, 5)]
    tool = problem_for(grid_graph(2, 3, 9), ())
    return shown, tool, candidates_for(tool, learn_generalising(shown, ("layout",), (0.1,)), np.random.default_rng(0))


def asked_to_the_end(lesson: Lesson, answer: Answer) -> tuple[ExceptionResult, dict[str, str]]:
    """Each step from its stored state."""
    shown, tool, found = lesson
    state, answers = ExceptionState(3), dict[str, str]()
    while True:
        stored = ExceptionState.from_json(state.to_json())
        result = exception_step(shown, tool, ExceptionParameters(), stored, answers, ExceptionMemory(found))
        if not result.questions:
            return result, answers
        state = result.state
        (q,) = result.questions
        assert q.differs
        answers[q.fingerprint] = answer if isinstance(answer, str) else reply_of(q.left, q.right, answer)


@pytest.mark.parametrize(("answer", "asked"), [("left_mine", 1), ("left", 3), ("cant_tell", 3)])
def test_ends_after_three_answers_or_with_my_way(lesson: Lesson, answer: str, asked: int) -> None:
    result, answers = asked_to_the_end(lesson, answer)
    assert len(answers) == asked
    assert bool(result.state.order) is (answer != "cant_tell")
    assert (result.state.probability == 1) is (answer == "left_mine")


def test_finds_the_order_that_is_wanted(lesson: Lesson) -> None:
    """The fifth likeliest of all candidates."""
    wanted = lesson[2].classes[4]
    result, _ = asked_to_the_end(lesson, wanted)
    assert result.state.order in wanted


def test_a_question_waits_for_its_answer(lesson: Lesson) -> None:
    shown, tool, found = lesson
    first = exception_step(shown, tool, ExceptionParameters(), ExceptionState(3), {}, ExceptionMemory(found))
    assert exception_step(shown, tool, ExceptionParameters(), first.state, {}, ExceptionMemory(found)).questions == first.questions
