"""The max-margin loss of the performance learner (Eq. 7), its subgradient and its exact minimiser over collected rows."""

from dataclasses import dataclass

import numpy as np

from app.learning.qp import Array, QuadraticProgram, solve

SNAP = 1e-7  # weights this close to their lower bound are put on it, so that ties the bound implies are exact


@dataclass(frozen=True)
class LossTerms:
    """The paper's factors in Eq. 7."""

    alpha: float
    beta: float
    gamma: float
    regularisation: float  # lambda


@dataclass(frozen=True)
class LossValue:
    """Eq. 7 at one w, with its parts."""

    alpha: float
    beta: float
    gamma: float
    regularisation: float

    @property
    def total(self) -> float:
        return self.alpha + self.beta + self.gamma + self.regularisation


def performance_loss(w: Array, demo: Array, samples: list[Array], best: Array, terms: LossTerms) -> LossValue:
    """Max-margin loss over all demonstrations (Eq. 7).

    Args:
        w: Weights, shape (n + m,).
        demo: Feature sums of the demonstrated sequences, shape (d, n + m).
        samples: Per demonstration, feature sums of its samples X, shape (p_i, n + m).
        best: Feature sums of the cheapest sequences under w, shape (d, n + m).

    Returns:
        The loss by parts; the alpha and beta parts are at most zero and the gamma part is zero when every demonstration is the cheapest.

    Paper: alpha, beta and gamma are shared by all tools here; Eq. 7 allows one per tool. Sums over tools are means, so that the
        factors keep their meaning when a tool is added.
    """
    cost = demo @ w
    mean = np.mean([c - (x @ w).mean() for c, x in zip(cost, samples, strict=True)])
    nearest = np.mean([c - (x @ w).min() for c, x in zip(cost, samples, strict=True)])
    return LossValue(
        terms.alpha * float(mean),
        terms.beta * float(nearest),
        terms.gamma * float((cost - best @ w).mean()),
        terms.regularisation * float(w @ w),
    )


def performance_gradient(w: Array, demo: Array, samples: list[Array], best: Array, terms: LossTerms) -> Array:
    """A subgradient of `performance_loss` at w, shape (n + m,); arguments as there."""
    gradient = 2 * terms.regularisation * w
    for phi, x, cheapest in zip(demo, samples, best, strict=True):
        nearest = x[int(np.argmin(x @ w))]
        step = terms.alpha * (phi - x.mean(axis=0)) + terms.beta * (phi - nearest) + terms.gamma * (phi - cheapest)
        gradient = gradient + step / len(demo)
    return gradient


def minimise_loss(demo: Array, samples: list[Array], cuts: list[list[Array]], terms: LossTerms, floor: Array) -> Array:
    """The exact minimiser of Eq. 7 with the cheapest sequence taken among `cuts` instead of all sequences.

    Args:
        demo: Feature sums of the demonstrated sequences, shape (d, n + m).
        samples: Per demonstration, feature sums of its samples X, shape (p_i, n + m).
        cuts: Per demonstration, feature sums of sequences that were once the cheapest.
        floor: Lower bound of each weight, shape (n + m,).

    Returns:
        w, shape (n + m,).

    Paper: Eq. 7 is convex and piecewise quadratic, so given the rows it is a small quadratic program: one bound b_i >= cost(demo) -
        cost(x) per tool for the beta part and one t_i >= 0, t_i >= cost(demo) - cost(cut) for the gamma part.
    """
    d, n = demo.shape
    rows: list[Array] = []
    for i in range(d):
        for x in samples[i]:
            rows.append(_row(demo[i] - x, n, d, i))
        for x in cuts[i]:
            rows.append(_row(demo[i] - x, n, d, d + i))
        rows.append(_row(np.zeros(n), n, d, d + i))
    bounds = np.hstack([-np.eye(n), np.zeros((n, 2 * d))])
    mean = np.mean([phi - x.mean(axis=0) for phi, x in zip(demo, samples, strict=True)], axis=0)
    program = QuadraticProgram(
        curvature=np.r_[np.full(n, 2 * terms.regularisation), np.zeros(2 * d)],
        slope=np.r_[terms.alpha * mean, np.full(d, terms.beta / d), np.full(d, terms.gamma / d)],
        rows=np.vstack([*rows, bounds]),
        limits=np.r_[np.zeros(len(rows)), -floor],
    )
    w = solve(program)[:n]
    return np.where(w - floor < SNAP, floor, w)


def _row(difference: Array, n: int, d: int, bound: int) -> Array:
    """difference . w - (bound variable) <= 0."""
    row = np.zeros(n + 2 * d)
    row[:n], row[n + bound] = difference, -1.0
    return row
