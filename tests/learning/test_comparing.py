"""The harness that compares learners, and the choice between certainty and likelihood."""

import numpy as np
import pytest

from app.learning.baselines.learner import Learned, by_weights
from app.learning.comparing import (
    ASKING,
    LEARNERS,
    Case,
    Score,
    format_comparison,
    learners,
    made_up_case,
    made_up_cases,
    not_best,
    score,
    summed,
)
from app.learning.generalising import learn_unasked
from app.learning.performance_state import LearningDemonstration
from app.sequencing.problem import problem_for
from tests.learning.test_baselines import TRUTH, shown
from tests.sequencing.graphs import grid_graph


def test_an_oracle_scores_full_marks_and_the_reverse_none():
    demos = tuple(shown(s) for s in range(1, 5))
    case = Case("made up", demos[:2], demos[2:], TRUTH)
    ticks = iter([1.0, 3.5, 0.0, 0.0])
    best = score("oracle", lambda d, _: by_weights(d, TRUTH, (True,) * 11), case, 0, lambda: next(ticks))
    assert (best.train_hits, best.test_hits, best.regret, best.tau, best.cpu_s) == (2, 2, 0.0, 1.0, 2.5)
    known = {id(d.problem): d.sequence[::-1] for d in demos}
    worst = score("reverse", lambda *_: Learned(lambda p: known[id(p)], None), case, 0, lambda: next(ticks))
    assert worst.test_hits == 0
    assert worst.tau == -1.0
    assert worst.regret is not None
    assert worst.regret > 0


def test_lines_are_means_over_cases():
    def one(hits: int, regret: float, cpu: float) -> Score:
        return Score("a", "made up", 6, 6, hits, 4, regret, 0.5, 2, cpu)

    (line,) = summed([one(4, 0.0, 1.0), one(2, 0.1, 3.0)])
    assert (line.cases, line.test_hits, line.test, line.test_success) == (2, 6, 8, 0.75)
    assert (line.regret, line.cpu_s) == (pytest.approx(0.05), 2.0)
    assert "75%" in format_comparison([line])
    assert "2 made-up experts" in format_comparison([line])


def test_made_up_experts_follow_their_weights_and_repeat():
    problems = {s: problem_for(grid_graph(2, 3, s), ()) for s in (1, 2, 3)}
    first, again = (list(made_up_cases(problems, (1, 2), 2, 5)) for _ in range(2))
    assert [len(c.train) for c in first] == [2, 2]
    for a, b in zip(first, again, strict=True):
        assert a.truth is not None
        assert b.truth is not None
        assert a.truth.tobytes() == b.truth.tobytes()
        assert all(d.problem.cost(a.truth, d.sequence) <= d.problem.cost(a.truth, d.sequence[::-1]) for d in (*a.train, *a.test))
    assert not np.allclose(first[0].truth, first[1].truth)


def test_agreeing_demonstrations_are_certified_and_contradicting_ones_are_not():
    """Two tools alike but for one demonstration reversed can't both be cheapest."""
    agree = [shown(s) for s in range(1, 4)]
    assert learn_unasked(agree).certificate is not None
    backwards = LearningDemonstration(agree[0].problem, agree[0].sequence[::-1])
    found = learn_unasked([*agree, backwards])
    assert found.certificate is None
    assert found.generalised is not None
    assert found.policy is found.generalised.policy


def test_where_ours_is_not_best_is_said_with_its_reason():
    def one(name: str, hits: int, tau: float, cpu: float) -> Score:
        return Score(name, "made up", 6, 6, hits, 4, 0.1, tau, 0, cpu)

    lines = summed(
        [one("ours", 4, 0.8, 2.0), one("ours, always certified", 4, 0.9, 0.1), one("A", 3, 0.85, 1.0), one("random weights", 1, 0, 0)]
    )
    tau, cpu = not_best(lines)
    assert tau.startswith("Not best in tau: A 0.850, ours 0.800; tau counts from the one order")
    assert cpu.startswith("Not best in cpu: A 1.00 s, ours 2.00 s;")
    assert tau in format_comparison(lines)
    assert not_best(lines[1:]) == []


def test_every_learner_is_compared_and_asking_leaves_no_tool_wrong():
    """An expert who follows weights: the certified run's own questions make all unseen tools hits, and each answer is counted."""
    problems = {s: problem_for(grid_graph(2, 3, s), ()) for s in range(1, 6)}
    cases = [made_up_case(problems, (1,), k) for k in range(3)]
    assert tuple(learners(cases[0], 0)) == LEARNERS
    found = [score(ASKING, learners(case, 0)[ASKING], case, 0, lambda: 0.0) for case in cases]
    plain = [score("ours", learners(case, 0)["ours"], case, 0, lambda: 0.0) for case in cases]
    assert sum(s.test_hits for s in found) == 12
    assert all(s.regret is not None and s.regret < 1e-9 for s in found)
    assert sum(s.test_hits for s in plain) < 12
    assert sum(s.answers for s in found) > sum(s.answers for s in plain) == 0


def test_an_order_settled_by_questions_counts_as_all_orders_of_equal_features():
    demo = shown(1)
    case = Case("real", (demo,), (demo,), None)

    def settling(orders: tuple[tuple[int, ...], ...]) -> Score:
        return score("a", lambda *_: Learned(lambda p: orders[0], None, 2, {id(demo.problem): orders}), case, 0, lambda: 0.0)

    other = demo.sequence[::-1]
    assert (settling((other, demo.sequence)).test_hits, settling((other,)).test_hits) == (1, 0)
    assert settling((other,)).answers == 2
