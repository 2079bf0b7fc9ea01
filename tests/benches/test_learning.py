"""The learning bench on the authors' tables, smallest doses."""

import itertools

import numpy as np

from app.benches.figures import Options
from app.benches.learning import measure
from app.learning.comparing import made_up_case
from app.learning.expert import ScriptedExpert
from app.learning.scripted import answer_pairs
from app.sequencing.problem import problem_for
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
    bins = [f for f in figures.values() if f.name.startswith("right where")]
    assert len(bins) >= 5
    assert all(a.value < b.value + 25 for a, b in itertools.pairwise(bins))  # surer is more often right; few experts
    assert abs(next(f.value for f in figures.values() if f.name == "right less stated, all tools")) < 12
    assert figures["authors' real tools", "hits after at most 3 answers per tool"].value == 2


def test_the_scripted_expert_endorses_only_cheapest_orders():
    problem, expert = problem_for(grid_graph(2, 3, 1), ()), ScriptedExpert(np.arange(1.0, 12.0), None)
    best = expert.sequence(problem)
    worst = best[::-1]
    assert expert.chooses(problem, best, worst) == "left"
    assert expert.chooses(problem, worst, best) == "right"
    assert expert.chooses(problem, worst, worst) == "both_wrong"
    assert expert.chooses(problem, best, best) == "equal"


def test_a_run_ends_with_every_tool_right():
    """Orders recorded because both shown ones were wrong are learned from: each counts, and none is wrong afterwards."""
    problems = {s: problem_for(grid_graph(2, 3, s), ()) for s in range(1, 6)}
    runs = []
    for k in range(6):
        case = made_up_case(problems, (1,), k)
        runs.append(answer_pairs(list(case.train), [d.problem for d in case.test], ScriptedExpert(case.truth, None)))
    assert sum(r.wrong for r in runs) == 0
    assert all(r.shown <= r.answers for r in runs)
    assert sum(r.shown for r in runs) > 0
