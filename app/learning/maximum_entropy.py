"""Maximum-entropy IRL on whole sequences, exact: p(xi) in proportion to exp(-w . Phi(xi)).

Nothing is sampled: the sum over all N! sequences is a dynamic program over sets of finished regions.
"""

from dataclasses import dataclass

import numpy as np
from scipy.optimize import minimize

from app.errors import InvalidInput
from app.learning.performance_state import LearningDemonstration
from app.learning.qp import Array
from app.learning.sampling import feature_scale, feature_sums, random_pool
from app.learning.soft_program import expected_sums, soft_to_go
from app.sequencing.problem import TENSOR_LIMIT

POOL = 100  # random sequences per tool that measure a feature's unit
SEED = 20230523  # of these sequences; fixed, so that the same demonstrations always give the same weights
STEPS = 200  # of the quasi-Newton descent, at most
NUDGE = 1e-4  # step of the differences behind the curvature


@dataclass(frozen=True)
class Lesson:
    """One demonstration, features in their units."""

    values: Array  # (2^N, N, F) features of each transition; anything where already done
    total: Array  # (F,) feature sum of the demonstration

    @property
    def n(self) -> int:
        return self.values.shape[1]


@dataclass(frozen=True)
class SoftFit:
    """Weights under which the demonstrations are likely."""

    weights: Array  # (F,) on scaled features
    penalty: float  # lambda of the squared norm
    surprise: float  # mean -log p of a demonstration under these weights
    curvatures: Array  # (lessons, F, F) covariance of the feature sums of each tool under these weights; none if not asked for

    @property
    def covariance(self) -> Array:
        """Of the weights given the demonstrations (Laplace), (F, F), counting the penalty once per demonstration."""
        lessons, size = self.curvatures.shape[:2]
        return np.linalg.inv(self.curvatures.sum(axis=0) + lessons * self.penalty * np.eye(size))


def lessons_of(demonstrations: list[LearningDemonstration]) -> tuple[list[Lesson], Array, tuple[bool, ...]]:
    """Demonstrations with features scaled to unit deviation within a tool, the units, and which features vary at all.

    Raises:
        InvalidInput: A tool has more regions than the table of all transitions can hold.
    """
    large = max((d.problem.n for d in demonstrations), default=0)
    if large > TENSOR_LIMIT:
        raise InvalidInput(f"Learning from likelihood needs tools of at most {TENSOR_LIMIT} regions; one has {large}.")
    generators = [np.random.default_rng([SEED, d.problem.n]) for d in demonstrations]
    sums = [feature_sums(d.problem, random_pool(d.problem, POOL, g)) for d, g in zip(demonstrations, generators, strict=True)]
    scale, live = feature_scale(sums)
    unit = np.where(live, 1 / scale, 0.0)  # a constant says nothing; its weight stays 0
    lessons = [Lesson(np.ascontiguousarray(d.problem.tensor() * unit), d.problem.feature_sum(d.sequence) * unit) for d in demonstrations]
    return lessons, scale, live


def surprise(lesson: Lesson, w: Array) -> tuple[float, Array]:
    """-log p of the demonstration and its gradient (F,): the demonstrated minus the expected feature sum."""
    to_go, chosen = soft_to_go(lesson.values, w, lesson.n)
    return float(w @ lesson.total - to_go[0]), lesson.total - expected_sums(lesson.values, chosen, lesson.n)


def fit(lessons: list[Lesson], penalty: float, start: Array | None = None, lower: Array | None = None, curved: bool = True) -> SoftFit:
    """Minimise the mean surprise + penalty / 2 * |w|^2.

    Args:
        lessons: At least one.
        penalty: Above 0.
        start: Where to begin, 0 if None.
        lower: Lower bounds of the weights, none if None.
        curved: Whether to measure the curvatures, which costs as much as the fit.
    """
    size = len(lessons[0].total)
    bounds = None if lower is None else [(float(x), None) for x in lower]
    begin = np.zeros(size) if start is None else start
    begin = begin if lower is None else np.maximum(begin, lower)

    def objective(w: Array) -> tuple[float, Array]:
        parts = [surprise(lesson, w) for lesson in lessons]
        value = sum(v for v, _ in parts) / len(parts) + penalty / 2 * float(w @ w)
        return value, sum((g for _, g in parts), np.zeros(size)) / len(parts) + penalty * w

    found = minimize(objective, begin, jac=True, method="L-BFGS-B", bounds=bounds, options={"maxiter": STEPS, "ftol": 1e-12, "gtol": 1e-7})
    w = np.asarray(found.x, np.float64)
    known = sum(surprise(lesson, w)[0] for lesson in lessons) / len(lessons)
    return SoftFit(w, penalty, known, curvatures_at(lessons, w) if curved else np.zeros((0, size, size)))


def curvatures_at(lessons: list[Lesson], w: Array) -> Array:
    """Per lesson the covariance of the feature sums under w, (lessons, F, F), by central differences of the exact gradient."""
    steps = NUDGE * np.eye(len(w))
    rows = np.array([[(surprise(t, w + step)[1] - surprise(t, w - step)[1]) / (2 * NUDGE) for step in steps] for t in lessons])
    return (rows + rows.transpose(0, 2, 1)) / 2


def left_out_weights(lessons: list[Lesson], found: SoftFit) -> list[Array]:
    """Per demonstration the weights that would be learned without it, each by one Newton step from the joint ones."""
    others, identity = len(lessons) - 1, found.penalty * np.eye(len(found.weights))
    joint = found.curvatures.sum(axis=0)
    return [
        found.weights
        + np.linalg.solve((joint - own) / others + identity, surprise(t, found.weights)[1] + found.penalty * found.weights) / others
        for t, own in zip(lessons, found.curvatures, strict=True)
    ]
