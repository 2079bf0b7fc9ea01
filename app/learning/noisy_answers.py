"""A posterior over weights for answers and demonstrations that may be wrong (Bradley-Terry, Boltzmann).

Where the hard version space knows only possible and impossible, here an answer makes weights that agree with it more likely,
the more so the larger the difference is; nothing is ruled out, so contradictions are weighed instead of refused.
"""

from collections.abc import Sequence as Ordered
from dataclasses import dataclass

import numpy as np

from app.learning.qp import Array

STEPS = 600  # of each chain; the chains are independent, so only their ends are samples
STRIDES = (0.05, 0.2, 0.7)  # sizes of a proposed move, taken in turn
EQUAL_WIDTH = 0.5  # "about equal" is as likely as not at this log-odds of a preference


@dataclass(frozen=True)
class Comparison:
    """What an answer to a pair says."""

    difference: Array  # (r,) feature sum of the right order minus that of the left one, in coordinates
    value: str  # "left", "right" or "equal"; other answers say nothing about weights
    count: int = 1  # how often it was given


def log_likelihood(samples: Array, comparisons: Ordered[Comparison], groups: Ordered[Array], sharpness: float) -> Array:
    """(s,) log-probability of all answers and demonstrations, up to a constant.

    Args:
        samples: Directions (s, r) of length 1.
        comparisons: Answers; P(left) = 1 / (1 + exp(-sharpness u . d / |d|)).
        groups: Per demonstration, unit rows (m, r) of its alternatives minus itself; exp(-sharpness x largest violation).
        sharpness: beta; large means an expert who never errs.
    """
    total = np.zeros(len(samples))
    for c in comparisons:
        size = float(np.linalg.norm(c.difference))
        if size < 1e-12 or c.value not in ("left", "right", "equal"):
            continue
        odds = sharpness * (samples @ c.difference) / size
        if c.value == "equal":
            total += -c.count * np.logaddexp(0.0, np.abs(odds) - EQUAL_WIDTH)
        else:
            total += -c.count * np.logaddexp(0.0, -odds if c.value == "left" else odds)
    for rows in groups:
        if len(rows):
            total += -sharpness * np.maximum(0.0, -(samples @ rows.T).min(axis=1))
    return total


def soft_samples(
    signed: Array, comparisons: Ordered[Comparison], groups: Ordered[Array], sharpness: float, count: int, generator: np.random.Generator
) -> Array:
    """Directions (count, r) drawn from the posterior; the prior is even over the directions with the declared signs.

    Independent Metropolis chains on the sphere; signed coordinates are reflected at 0, which keeps the proposal symmetric.
    """
    at = _fold(generator.normal(size=(count, len(signed))), signed)
    value = log_likelihood(at, comparisons, groups, sharpness)
    for step in range(STEPS):
        stride = STRIDES[step % len(STRIDES)]
        proposed = _fold(at + stride * generator.normal(size=at.shape), signed)
        other = log_likelihood(proposed, comparisons, groups, sharpness)
        taken = np.log(generator.random(count)) < other - value
        at[taken], value[taken] = proposed[taken], other[taken]
    return at


def _fold(x: Array, signed: Array) -> Array:
    x = np.where(signed > 0, np.abs(x), x)
    return x / np.maximum(np.linalg.norm(x, axis=1, keepdims=True), 1e-300)


def reliability(repeats: Ordered[tuple[str, str]]) -> float | None:
    """Probability that one answer is what the expert means, from questions answered twice; None without any.

    Two answers agree with probability p^2 + (1 - p)^2 when each is right with probability p; one agreement and one
    disagreement are added, so that few repeats don't claim certainty.
    """
    told = [(a, b) for a, b in repeats if "cant_tell" not in (a, b)]
    if not told:
        return None
    agreed = (sum(a == b for a, b in told) + 1) / (len(told) + 2)
    return 0.5 * (1 + float(np.sqrt(max(0.0, 2 * agreed - 1))))
