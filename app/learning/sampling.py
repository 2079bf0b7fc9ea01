"""Sequences to compare a demonstration with: random, and as unlike it and each other as possible (Algorithm 1, line 1)."""

import numpy as np

from app.learning.qp import Array
from app.sequencing.problem import SequencingProblem

POOL = 200  # random sequences per tool from which the sample is taken and the scale is measured


def random_pool(problem: SequencingProblem, size: int, generator: np.random.Generator) -> tuple[tuple[int, ...], ...]:
    """`size` uniformly random sequences of the tool."""
    return tuple(tuple(int(a) for a in generator.permutation(problem.n)) for _ in range(size))


def feature_sums(problem: SequencingProblem, sequences: tuple[tuple[int, ...], ...]) -> Array:
    """Feature sums, shape (sequences, n + m)."""
    return np.array([problem.feature_sum(sequence) for sequence in sequences]).reshape(len(sequences), -1)


def feature_scale(sums: list[Array]) -> tuple[Array, tuple[bool, ...]]:
    """Unit of each feature sum, and whether it varies at all.

    Args:
        sums: Per demonstrated tool, feature sums of random sequences, shape (pool, n + m).

    Returns:
        The standard deviation within a tool, pooled over tools, shape (n + m,), and per column whether it can be identified:
        a feature whose sum is a constant of every demonstrated tool gets scale 1 and False.

    Paper: the features are used unscaled there. Any norm on w then depends on their units, so we scale first. The deviation *within*
        tools gives both halves of a done / not-done pair the same unit, which keeps their constant sum constant.
    """
    deviation = np.sqrt(np.mean([block.var(axis=0) for block in sums], axis=0))
    size = np.mean([np.abs(block).mean(axis=0) for block in sums], axis=0)
    live = deviation > 1e-9 * np.maximum(1.0, size)
    return np.where(live, deviation, 1.0), tuple(bool(x) for x in live)


def diverse_sample(demonstrated: Array, pool: Array, count: int, zeta: float) -> list[int]:
    """Indices into the pool of sequences whose feature sums point away from the demonstration and from each other.

    Args:
        demonstrated: Scaled feature sum of the demonstration, shape (n + m,).
        pool: Scaled feature sums of random sequences, shape (pool, n + m).
        count: How many are wanted (p).
        zeta: Largest cosine similarity allowed between any two chosen.

    Returns:
        Up to `count` indices, the most unlike first; at least one.

    Paper: zeta is absolute there. Feature sums of one tool share a large common part, so the cosine is taken on the deviation from the
        pool's mean; otherwise every pair would be above any useful zeta.
    """
    centre = pool.mean(axis=0)
    unit = _unit(pool - centre)
    likeness = unit @ _unit((demonstrated - centre)[None])[0]
    chosen: list[int] = []
    while len(chosen) < min(count, len(pool)):
        best = int(np.argmin(likeness))
        if chosen and likeness[best] > zeta:
            break
        chosen.append(best)
        likeness = np.maximum(likeness, unit @ unit[best])
        likeness[best] = np.inf
    return chosen


def _unit(rows: Array) -> Array:
    return rows / np.maximum(np.linalg.norm(rows, axis=1, keepdims=True), 1e-12)
