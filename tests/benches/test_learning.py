"""The learning bench on the authors' tables, smallest doses."""

import numpy as np

from app.benches.figures import Options
from app.benches.learning import measure
from app.benches.teaching import made_up_truths, reply, teach
from app.learning.pairs import PairQuestion
from app.learning.performance_state import LearningDemonstration
from app.sequencing.problem import problem_for
from app.sequencing.shortest import shortest_sequence
from tests.conftest import shared
from tests.sequencing.graphs import grid_graph


def test_figures_of_the_quick_bench():
    """Six training tools are hit with and without answers; likelihood hits the first two real tools but tool 1; bytes repeat."""
    figures = {(f.group.split(",")[0], f.name): f for f in measure(Options(data=shared("datasets", "authors"), quick=True))}
    found = {name: f.value for (group, name), f in figures.items() if group.startswith("authors' synthetic")}
    assert found["training tools hit"] == 6
    assert found["test tools hit"] == 4
    assert found["answers, with a stop of its own"] <= 2
    assert found["same seed and answers give the same bytes"] == 1
    assert figures["authors' real tools", "hits, no answers"].value == 1
    assert "missed: 1;" in figures["authors' real tools", "hits, no answers"].note
    assert figures["authors' real tools", "hits after 3 answers per tool"].value == 2


def test_the_scripted_expert_endorses_only_cheapest_orders():
    problem, truth = problem_for(grid_graph(2, 3, 1), ()), np.arange(1.0, 12.0)
    best = shortest_sequence(problem, truth).sequence
    worst = best[::-1]

    def asked(left: tuple[int, ...], right: tuple[int, ...]) -> str:
        fields = {name: None for name in PairQuestion.__dataclass_fields__}
        return reply(problem, PairQuestion(**{**fields, "left": left, "right": right}), truth)  # type: ignore[arg-type]

    assert asked(best, worst) == "left"
    assert asked(worst, best) == "right"
    assert asked(worst, worst) == "both_wrong"
    assert asked(best, best) == "equal"


def test_a_run_ends_with_every_tool_right_or_shown():
    problems = [problem_for(grid_graph(2, 3, s), ()) for s in range(1, 5)]
    (truth,) = made_up_truths(1, 11)
    demos = [LearningDemonstration(p, shortest_sequence(p, truth).sequence) for p in problems[:2]]
    done = teach(demos, problems[2:], truth)
    assert done.wrong == 0
    assert done.answers >= done.shown
