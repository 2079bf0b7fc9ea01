"""How sure a policy is that was learned by likelihood: which weights are as likely, and what they would choose on other tools.

Weights near the learned ones are drawn from the normal distribution that the curvature of the likelihood says (Laplace).
"""

from collections.abc import Sequence as Ordered
from dataclasses import dataclass

import numpy as np

from app.learning.certified_state import ToolChance
from app.learning.generalising import Generalised
from app.learning.many_optima import cheapest_orders, sums_of
from app.learning.qp import Array
from app.sequencing.problem import TENSOR_LIMIT, SequencingProblem

DRAWN = 64
COSTLY = 12  # of them looked at on a tool above 14 regions, where each is a search of its own
CREDIBLE = (0.05, 0.95)
EQUAL = 1e-9  # relative: costs this close are the same
DIGITS = 7  # of a cost relative to its size, by which classes are told apart


@dataclass(frozen=True)
class Sureness:
    """What the demonstrations leave open."""

    shares: tuple[float, ...]  # (k,) of each weight on scaled features; their sizes add up to 1
    intervals: tuple[tuple[float, float], ...]  # (k,) 5 % and 95 % of these shares
    tools: tuple[ToolChance, ...]


def sureness(found: Generalised, tools: Ordered[SequencingProblem], tolerance: float, seed: int = 0) -> Sureness:
    """Of a learned policy.

    Args:
        found: Learned from the demonstrations.
        tools: Under the policy's features.
        tolerance: Relative extra cost that nobody would notice.
        seed: Of the draws.
    """
    live, mean = np.array(found.policy.identifiable), found.fit.weights
    drawn = np.random.default_rng(seed).multivariate_normal(mean, found.fit.covariance, DRAWN, method="cholesky") * live
    shares = np.vstack([mean * live, drawn])
    shares = shares / np.maximum(np.abs(shares).sum(axis=1, keepdims=True), 1e-300)
    low, high = np.quantile(shares[1:], CREDIBLE, axis=0)
    weights = np.vstack([found.policy.weights, drawn / found.scale])
    return Sureness(
        tuple(float(x) for x in shares[0]),
        tuple((float(a), float(b)) for a, b in zip(low, high, strict=True)),
        tuple(
            _chance(t, problem, weights if problem.n <= TENSOR_LIMIT else weights[: 1 + COSTLY], tolerance)
            for t, problem in enumerate(tools)
        ),
    )


def _chance(tool: int, problem: SequencingProblem, weights: Array, tolerance: float) -> ToolChance:
    """What the draws (rows after the first) say about the order that the first row chooses."""
    raw = sums_of(problem, cheapest_orders(problem, weights))
    cost = raw @ weights.T  # (orders, weights)
    size = np.maximum(np.abs(raw) @ np.abs(weights).T, 1e-300).max(axis=0)
    extra = ((cost[0] - cost.min(axis=0)) / size)[1:]
    classes = len(np.unique(np.round(raw @ weights[0] / size[0], DIGITS)))
    worst = float(np.quantile(extra, CREDIBLE[1]))
    return ToolChance(tool, round(float((extra <= EQUAL).mean()), 6), round(worst, 9), worst <= tolerance + EQUAL, classes, len(extra))
