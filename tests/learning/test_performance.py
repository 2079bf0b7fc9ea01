"""Algorithm 1: recovery of known weights, resumability bit for bit, honest endings."""

import json
from dataclasses import replace

import numpy as np
import pytest

from app.errors import EmptySample, IncompleteSequence, InvalidInput
from app.learning.expert import ScriptedExpert
from app.learning.performance import (
    PARAMETER_WORDS,
    LearningDemonstration,
    PerformanceParameters,
    PerformanceState,
    performance_step,
    start_performance,
)
from app.learning.performance_conflict import Contradiction
from app.learning.questions import appearance
from app.learning.scripted import answer_similarity
from app.sequencing.shortest import shortest_sequence
from tests.learning.made_up import TRUE_WEIGHTS, demonstrations, problems

EXPERT = ScriptedExpert(TRUE_WEIGHTS, None)
PARAMETERS = PerformanceParameters(iterations=20, rounds=6)
ASKING = PerformanceParameters(iterations=3, rounds=30)  # short rounds: the stop test comes early and fails
CONTRADICTION = PerformanceParameters(iterations=10, rounds=4)


@pytest.fixture(scope="module")
def demos():
    return demonstrations(EXPERT, problems(4))


def asking_seed(demos) -> int:
    """A seed whose first round ends with questions."""
    for seed in range(40):
        state = start_performance(demos, ASKING, seed)
        if performance_step(demos, ASKING, state, {}, 3).questions:
            return seed
    raise AssertionError("no seed asks anything")


def test_known_weights_are_recovered(demos):
    """The learned weights make every demonstration of a known expert the cheapest (1e-9 relative), which random weights do not."""
    result, _ = answer_similarity(demos, EXPERT, PARAMETERS, start_performance(demos, PARAMETERS, 0), 100)
    assert result.outcome == "converged"

    def excess(w):
        return max(d.problem.cost(w, d.sequence) / shortest_sequence(d.problem, w).cost - 1 for d in demos)

    assert excess(result.weights) < 1e-9
    assert excess(np.random.default_rng(0).uniform(0.1, 1, 13)) > 1e-3


def test_chunks_do_not_matter(demos):
    """10 + 10 steps are 20 steps, to the last bit, through JSON in between."""
    parameters = replace(PARAMETERS, iterations=50)
    start = start_performance(demos, parameters, 5)
    whole = performance_step(demos, parameters, start, {}, 20)
    half = performance_step(demos, parameters, start, {}, 10)
    stored = PerformanceState.from_json(json.loads(json.dumps(half.state.to_json())))
    assert stored == half.state
    rest = performance_step(demos, parameters, stored, {}, 10)
    assert rest.state == whole.state
    assert (*half.metrics, *rest.metrics) == whole.metrics
    assert [m.iteration for m in whole.metrics] == list(range(1, 21))


def test_interrupted_run_ends_with_the_same_weights(demos):
    """Every step in a new 'process' (through JSON), one iteration at a time, against one uninterrupted run with questions."""
    seed = asking_seed(demos)
    whole, answers = answer_similarity(demos, EXPERT, ASKING, start_performance(demos, ASKING, seed), 1000)
    assert answers
    state, given = start_performance(demos, ASKING, seed), {}
    while True:
        state = PerformanceState.from_json(json.loads(json.dumps(state.to_json())))
        step = performance_step(demos, ASKING, state, given, 1)
        state = step.state
        if step.questions:  # one answer at a time
            q = step.questions[0]
            d = demos[q.demonstration]
            given[q.fingerprint] = EXPERT.similar(d.problem, d.sequence, q.candidate)
        elif step.outcome != "training":
            break
    assert given == answers
    assert step.outcome == whole.outcome
    assert np.array_equal(step.weights, whole.weights)


def test_other_seed_other_path(demos):
    a = performance_step(demos, PARAMETERS, start_performance(demos, PARAMETERS, 1), {}, 5)
    b = performance_step(demos, PARAMETERS, start_performance(demos, PARAMETERS, 2), {}, 5)
    assert not np.array_equal(a.weights, b.weights)


def test_questions_are_new_and_worth_asking(demos):
    """No feature sum twice, none equal to the demonstration's, none dearer than the demonstration under the weights at hand."""
    seen: dict[int, list[np.ndarray]] = {i: [d.problem.feature_sum(d.sequence)] for i, d in enumerate(demos)}
    state, answers, prints = start_performance(demos, ASKING, asking_seed(demos)), {}, []
    while True:
        step = performance_step(demos, ASKING, state, answers, 1000)
        state = step.state
        if step.outcome not in ("training", "questions"):
            break
        for q in step.questions:
            d = demos[q.demonstration]
            phi = d.problem.feature_sum(q.candidate)
            assert all(np.abs(phi - known).max() > 1e-9 for known in seen[q.demonstration])
            assert d.problem.cost(step.weights, q.candidate) <= d.problem.cost(step.weights, d.sequence) * (1 + 1e-3)
            assert q.differs == tuple(a for a, b in zip(d.sequence, q.candidate, strict=True) if a != b)
            seen[q.demonstration].append(phi)
            prints.append(q.fingerprint)
            answers[q.fingerprint] = "not_similar"
    assert prints
    assert len(set(prints)) == len(prints)


def test_open_question_blocks_and_undo_reopens(demos):
    """No step is taken while an answer is missing; taking one back asks the same question again."""
    state = start_performance(demos, ASKING, asking_seed(demos))
    asked = performance_step(demos, ASKING, state, {}, 1000)
    waiting = performance_step(demos, ASKING, asked.state, {}, 1000)
    assert waiting.outcome == "questions"
    assert waiting.questions == asked.questions
    assert waiting.metrics == ()
    answers = {q.fingerprint: "not_similar" for q in asked.questions}
    later = performance_step(demos, ASKING, asked.state, answers, 1)
    assert later.metrics
    taken_back = dict(list(answers.items())[1:])
    again = performance_step(demos, ASKING, later.state, taken_back, 1)
    assert [q.fingerprint for q in again.questions] == [asked.questions[0].fingerprint]


def test_not_similar_answers_change_the_weights_similar_ones_do_not(demos):
    """Only a candidate called not similar joins the sample X (Algorithm 1)."""
    state = start_performance(demos, ASKING, asking_seed(demos))
    asked = performance_step(demos, ASKING, state, {}, 1000)
    first = asked.questions[0].fingerprint

    def after(value: str):
        answers = {q.fingerprint: "not_similar" for q in asked.questions} | {first: value}
        if len(asked.questions) == 1 and value == "similar":
            return None
        return performance_step(demos, ASKING, asked.state, answers, 2).weights

    assert not np.array_equal(after("not_similar"), after("cant_tell"))


def contradiction() -> list[LearningDemonstration]:
    """The same tool demonstrated in two orders that no weights both prefer: one as its expert likes it, one backwards."""
    tool = problems(1)[0]
    order = EXPERT.sequence(tool)
    return [LearningDemonstration(tool, order), LearningDemonstration(tool, order[::-1])]


def test_contradicting_demonstrations_end_as_infeasible():
    """Of two nobody can say which one is wrong: both are named."""
    demos = contradiction()
    result, _ = answer_similarity(demos, ScriptedExpert(None, None), CONTRADICTION, start_performance(demos, CONTRADICTION, 0), 1000)
    assert result.outcome == "infeasible"
    assert result.message.startswith("Demonstration 1 and demonstration 2 contradict each other")
    assert result.state.contradiction == Contradiction((0, 1), clear=False, alone=False, rest=False)
    assert np.isfinite(result.weights).all()


@pytest.mark.parametrize("odd", [0, 3, 5])
def test_one_reversed_among_five_is_named_after_few_questions(odd: int):
    """At most 2 rounds and 6 questions, whatever is answered "No"; the compromise explains the other five exactly."""
    six = demonstrations(EXPERT, problems(6))
    six[odd] = replace(six[odd], sequence=six[odd].sequence[::-1])
    parameters = PerformanceParameters()
    result, answers = answer_similarity(six, ScriptedExpert(None, None), parameters, start_performance(six, parameters, 1), 7)
    assert result.outcome == "infeasible"
    assert len(answers) <= 6
    assert result.state.round <= 2
    assert result.state.contradiction is not None
    assert result.state.contradiction.odd == (odd,)
    assert result.message.startswith(f"Demonstration {odd + 1} c")
    assert f"Record demonstration {odd + 1} again" in result.message
    assert PerformanceState.from_json(json.loads(json.dumps(result.state.to_json()))) == result.state
    for i, d in enumerate(six):
        excess = d.problem.cost(result.weights, d.sequence) / shortest_sequence(d.problem, result.weights).cost - 1
        assert (excess > 1e-3) == (i == odd)


def test_six_consistent_ones_converge_with_few_questions_a_round():
    six = demonstrations(EXPERT, problems(6))
    parameters = replace(ASKING, most=2, classes=5)
    state, answers, rounds = start_performance(six, parameters, asking_seed(six)), {}, []
    while (step := performance_step(six, parameters, state, answers, 1000)).outcome in ("training", "questions"):
        state = step.state
        for q in step.questions:
            d = six[q.demonstration]
            answers[q.fingerprint] = EXPERT.similar(d.problem, d.sequence, q.candidate)
        rounds += [len(step.questions)] if step.questions else []
    assert step.outcome == "converged"
    assert step.metrics[-1].violations == 0
    assert step.metrics[-1].iteration == step.state.iteration
    assert rounds
    assert max(rounds) <= 2
    looks = [(q.demonstration, appearance(six[q.demonstration].sequence, q.candidate)) for q in step.state.asked]
    assert len(set(looks)) == len(looks)


def test_the_last_metric_describes_the_last_weights(demos):
    """Of a converged run: no violation, and the loss of the weights it ends with, not of those a step before."""
    for seed in range(4):
        state, answers, metrics = start_performance(demos, ASKING, seed), {}, []
        while True:
            step = performance_step(demos, ASKING, state, answers, 1000)
            state = step.state
            metrics += step.metrics
            for q in step.questions:
                d = demos[q.demonstration]
                answers[q.fingerprint] = EXPERT.similar(d.problem, d.sequence, q.candidate)
            if step.outcome not in ("training", "questions"):
                break
        assert step.outcome == "converged"
        assert [m.iteration for m in metrics] == list(range(1, state.iteration + 1))
        assert metrics[-1].violations == 0
        assert metrics[-1].terms["regularisation"] == pytest.approx(ASKING.regularisation * float(state.w @ state.w), rel=1e-12)


def test_orders_that_look_alike_have_one_appearance():
    """The same step, the same other region, end and count; only the middle differs."""
    mine = (0, 1, 2, 3, 4, 5)
    assert appearance(mine, (1, 0, 3, 2, 4, 5)) == appearance(mine, (1, 0, 2, 4, 3, 5)) == (0, 1, 5, 4)
    assert appearance(mine, (0, 2, 1, 3, 4, 5)) != appearance(mine, (1, 0, 2, 3, 4, 5))


def test_all_similar_stalls():
    """Contradicting demonstrations whose every alternative the expert calls just as good: nothing grows."""
    demos = contradiction()
    state = start_performance(demos, CONTRADICTION, 0)
    while (step := performance_step(demos, CONTRADICTION, state, {}, 1000)).outcome == "training":
        state = step.state
    assert step.outcome == "questions"
    stalled = performance_step(demos, CONTRADICTION, step.state, {q.fingerprint: "similar" for q in step.questions}, 1000)
    assert stalled.outcome == "stalled"
    assert stalled.metrics == ()


def test_loss_falls_and_violations_vanish(demos):
    parameters = replace(PARAMETERS, iterations=60)
    step = performance_step(demos, parameters, start_performance(demos, parameters, 3), {}, 60)
    assert step.metrics[-1].loss < 0.5 * step.metrics[0].loss
    assert step.metrics[-1].loss == pytest.approx(sum(step.metrics[-1].terms.values()))


def test_refusals(demos):
    with pytest.raises(EmptySample, match="at least one"):
        start_performance([], PARAMETERS, 0)
    with pytest.raises(IncompleteSequence):
        start_performance([LearningDemonstration(demos[0].problem, (0, 1, 2))], PARAMETERS, 0)
    state = start_performance(demos, PARAMETERS, 0)
    with pytest.raises(InvalidInput, match="started with"):
        performance_step(demos[:-1], PARAMETERS, state, {}, 1)
    bare = replace(demos[0].problem, interactions=())
    with pytest.raises(InvalidInput, match="same features"):
        start_performance([demos[1], LearningDemonstration(bare, demos[0].sequence)], PARAMETERS, 0)


def test_every_hyperparameter_has_words():
    assert set(PARAMETER_WORDS) == set(PerformanceParameters.__dataclass_fields__)
