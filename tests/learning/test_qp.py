"""Quadratic programs meet their optimality conditions (Karush, Kuhn, Tucker), Eq. 8 among them."""

import numpy as np
import pytest
from scipy.optimize import nnls

from app.learning.effort import EffortParameters, _Answered, _fit
from app.learning.qp import QuadraticProgram, solve


def residual(program: QuadraticProgram, x: np.ndarray) -> float:
    """How far the gradient is from a combination, with multipliers >= 0, of the rows that hold with equality."""
    active = program.limits - program.rows @ x < 1e-6
    gradient = program.curvature * x + program.slope
    return float(nnls(program.rows[active].T, -gradient)[1]) if active.any() else float(np.linalg.norm(gradient))


@pytest.mark.parametrize("seed", range(5))
def test_solutions_are_feasible_and_stationary(seed):
    rng = np.random.default_rng(seed)
    program = QuadraticProgram(rng.uniform(0.1, 2, 6), rng.normal(size=6), rng.normal(size=(15, 6)), rng.uniform(0, 1, 15))
    x = solve(program)
    assert (program.rows @ x <= program.limits + 1e-8).all()
    assert residual(program, x) < 1e-6
    assert residual(program, 0.9 * x + 0.01) > 1e-3  # the test can fail


@pytest.mark.parametrize("seed", range(3))
def test_effort_weights_are_the_minimiser_of_eq_8(seed):
    """With slack put in its place: w is stationary under w >= 0, each violated answer pulls with its full weight, others with none."""
    rng, parameters = np.random.default_rng(seed), EffortParameters(regularisation=0.3)
    known = [_Answered(str(k), rng.normal(size=8), "left", np.zeros(8)) for k in range(12)]
    w = _fit(known, parameters)
    rows = np.array([a.difference for a in known])
    short = parameters.margin - rows @ w
    violated, met = short > 1e-6, np.abs(short) <= 1e-6
    pull = parameters.regularisation * w - rows[violated].sum(axis=0)  # what the rows that just hold and the bounds have to balance
    free = w > 0
    columns = np.hstack([rows[met].T, np.eye(8)[:, ~free]])
    multipliers, left = nnls(columns, pull)
    assert left < 1e-4 * max(1.0, float(np.linalg.norm(pull)))
    assert (multipliers[: met.sum()] <= 1 + 1e-4).all()
