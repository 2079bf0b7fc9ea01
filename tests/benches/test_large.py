"""The bench beyond 2^N, and that the general solver is given the same cost."""

import pytest

from app.benches.figures import Options
from app.benches.large import FAMILIES, beyond, weights
from app.sequencing.large import best_found
from app.sequencing.problem import problem_for


def test_quick_figures_of_every_family():
    figures = list(beyond(Options(quick=True)))
    names = [f.name for f in figures if f.name.endswith("gap")]
    assert len(names) == len(FAMILIES) == 3
    assert all(0 <= f.value < 100 for f in figures if f.name.endswith("gap"))
    assert all(f.met for f in figures if "above the optimum" in f.name)


@pytest.mark.parametrize("family", ["saddle", "region table"])
def test_the_solver_proves_the_same_cost(family: str):
    solver = pytest.importorskip("app.benches.didp_model", reason="didppy is not installed (group bench)", exc_type=ImportError)
    problem = problem_for(FAMILIES[family](12))
    w = weights(problem, 1)
    order, proved, trace = solver.solve(problem, w, 60.0)
    assert proved
    assert trace[-1][1] == pytest.approx(problem.cost(w, order))
    assert problem.cost(w, order) == pytest.approx(problem.cost(w, best_found(problem, w)))
