"""Quadratic programs meet their optimality conditions (Karush, Kuhn, Tucker), Eq. 8 among them."""

import numpy as np
import pytest
from scipy.optimize import nnls

from app.learning import certified, loss
from app.learning.baselines import margin_planning
from app.learning.effort import EffortParameters, _Answered, _fit
from app.learning.expert import ScriptedExpert
from app.learning.performance_state import LearningDemonstration
from app.learning.qp import QuadraticProgram, solve
from tests.learning.made_up import TRUE_WEIGHTS, demonstrations, problems


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


@pytest.mark.parametrize("of", [loss, certified, margin_planning], ids=["Eq. 7", "least slack", "margin planning"])
def test_programs_of_the_learners_are_solved_to_their_conditions(of, monkeypatch: pytest.MonkeyPatch):
    """Each program a learner poses: feasible, stationary with multipliers >= 0 on the rows that hold, and not so elsewhere."""
    posed: list[tuple[QuadraticProgram, np.ndarray]] = []

    def watched(program: QuadraticProgram) -> np.ndarray:
        posed.append((program, solve(program)))
        return posed[-1][1]

    monkeypatch.setattr(of, "solve", watched)
    demos = demonstrations(ScriptedExpert(TRUE_WEIGHTS, None), problems(3))
    reverse = LearningDemonstration(demos[0].problem, demos[0].sequence[::-1])
    if of is loss:
        rng = np.random.default_rng(0)
        demo, samples = rng.uniform(0, 2, (3, 4)), [rng.uniform(0, 3, (k, 4)) for k in (2, 5, 3)]
        loss.minimise_loss(demo, samples, [[x] for x in rng.uniform(0, 3, (3, 4))], loss.LossTerms(0.3, 0.7, 5.0, 0.2), np.full(4, 0.05))
    elif of is certified:
        certified.certify([reverse, *demos])
    else:
        margin_planning.plan_by_margin([reverse, *demos], np.random.default_rng(0))
    assert posed
    for program, x in posed:
        assert (program.rows @ x <= program.limits + 1e-7).all()
        assert residual(program, x) < 1e-5 * max(1.0, float(np.abs(program.slope).max()))
    program, x = posed[-1]
    assert residual(program, 0.9 * x + 0.01) > 1e-3
