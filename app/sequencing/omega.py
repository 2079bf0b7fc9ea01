"""The search behind Omega (Eq. 3): sequences whose feature sums all equal a given total.

A prefix is dropped as soon as some remaining total is out of reach, for each feature alone and for a few random mixtures
of them (which see what no single feature sees).
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from app.geometry.tool import Array
from app.sequencing import kernels
from app.sequencing.problem import CHUNK, SequencingProblem, sets_from

EQUAL = 1e-9  # relative to the largest total of each quantity
MIXTURES = 4
NODES = 20_000  # prefixes looked at before the search of a tool above 14 regions gives up


@dataclass(frozen=True)
class Reach:
    """What totals of P quantities are still possible from each set, and the totals asked for."""

    mix: Array  # (n + m, P) quantities as mixtures of the features
    target: Array  # (P,)
    low: Array  # (2^N, P)
    high: Array  # (2^N, P)
    slack: Array  # (P,) difference that still counts as equal


def equal_sums(problem: SequencingProblem, sequence: tuple[int, ...], cap: int) -> tuple[list[tuple[int, ...]], bool]:
    """Members of Omega, lowest ids first, at most `cap`, and whether these are all. For at most 14 regions."""
    r = _reach(problem, sequence)
    found, complete = kernels.members_within(problem.tensor() @ r.mix, problem.n, r.target, r.low, r.high, r.slack, cap)
    return [tuple(int(a) for a in row) for row in found], complete


def equal_sums_searched(problem: SequencingProblem, sequence: tuple[int, ...], cap: int) -> tuple[list[tuple[int, ...]], bool]:
    """The same for 15 to 20 regions, where the table of all transitions is too large: features are computed on the way."""
    found: list[tuple[int, ...]] = []
    for visited, order in enumerate(_walk(problem, _reach(problem, sequence))):
        if visited == NODES or len(found) > cap:
            return found[:cap], False
        if len(order) == problem.n:
            found.append(order)
    return found[:cap], len(found) <= cap


def _reach(problem: SequencingProblem, sequence: tuple[int, ...]) -> Reach:
    """Bounds for each feature alone and for random mixtures, all scaled by the size of the sequence's total."""
    total, n = problem.feature_sum(sequence), problem.n
    drawn = np.random.default_rng(0).normal(size=(len(total), MIXTURES))  # fixed: the same pruning everywhere
    mix = np.hstack([np.eye(len(total)), drawn]) / np.maximum(np.abs(total), 1e-3)[:, None]
    low, high = np.zeros((1 << n, mix.shape[1])), np.zeros((1 << n, mix.shape[1]))
    for start in range(max(0, (1 << n) - CHUNK), -1, -CHUNK):
        kernels.range_to_go(problem.values(sets_from(start, CHUNK, n)) @ mix, start, n, low, high)
    slack = EQUAL * np.maximum(np.maximum(np.abs(low[0]), np.abs(high[0])), 1.0)
    return Reach(mix, total @ mix, low, high, slack)


def _walk(problem: SequencingProblem, reach: Reach) -> Iterator[tuple[int, ...]]:
    """Every prefix whose remaining totals are still in reach, depth-first, lowest ids first."""
    stack: list[tuple[tuple[int, ...], int, Array]] = [((), 0, np.zeros(len(reach.target)))]
    while stack:
        order, state, spent = stack.pop()
        yield order
        done = (state >> np.arange(problem.n) & 1).astype(np.bool_)
        total = spent + problem.values(done[None, :])[0] @ reach.mix
        after = state | np.int64(1) << np.arange(problem.n)
        rest = reach.target - total
        possible = ((rest >= reach.low[after] - reach.slack) & (rest <= reach.high[after] + reach.slack)).all(axis=1) & ~done
        stack.extend(((*order, int(a)), int(after[a]), total[a]) for a in np.flatnonzero(possible)[::-1])
