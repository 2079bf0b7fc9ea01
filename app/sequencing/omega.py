"""The search behind Omega (Eq. 3): sequences whose feature sums all equal a given total.

A prefix is dropped as soon as some remaining total is out of reach, for each feature alone and for a few random mixtures
of them (which see what no single feature sees).
"""

from collections.abc import Iterator

import numpy as np

from app.geometry.tool import Array
from app.sequencing import kernels
from app.sequencing.problem import SequencingProblem

EQUAL = 1e-9  # relative to the largest total of each quantity
MIXTURES = 4
NODES = 20_000  # prefixes looked at before the search of a tool above 14 regions gives up


def equal_sums(problem: SequencingProblem, sequence: tuple[int, ...], cap: int) -> tuple[list[tuple[int, ...]], bool]:
    """Members of Omega, lowest ids first, at most `cap`, and whether these are all. For at most 14 regions."""
    mix = _mixtures(len(problem.columns), problem.feature_sum(sequence))
    g = problem.tensor() @ mix
    bounds = [kernels.range_to_go(np.ascontiguousarray(g[:, :, p]), problem.n) for p in range(g.shape[2])]
    low, high = (np.stack([b[side] for b in bounds], axis=1) for side in (0, 1))
    target = problem.feature_sum(sequence) @ mix
    slack = EQUAL * np.maximum(np.maximum(np.abs(low[0]), np.abs(high[0])), 1.0)
    found, complete = kernels.members_within(g, problem.n, target, low, high, slack, cap)
    return [tuple(int(a) for a in row) for row in found], complete


def _mixtures(columns: int, total: Array) -> Array:
    """(columns, P): each column alone and a few random mixtures, all scaled by the size of the total."""
    scale = 1 / np.maximum(np.abs(total), 1e-6)
    drawn = np.random.default_rng(0).normal(size=(columns, MIXTURES))  # fixed: the same pruning everywhere
    return np.hstack([np.eye(columns), drawn]) * np.minimum(scale, 1e3)[:, None]


def equal_sums_searched(problem: SequencingProblem, sequence: tuple[int, ...], cap: int) -> tuple[list[tuple[int, ...]], bool]:
    """The same for 15 to 20 regions, where the table of all transitions is too large: features are computed on the way."""
    total = problem.feature_sum(sequence)
    mix = _mixtures(len(problem.columns), total)[:, -MIXTURES:]
    bounds = [kernels.range_to_go(problem.cost_table(mix[:, p]), problem.n) for p in range(MIXTURES)]
    low, high = (np.stack([b[side] for b in bounds], axis=1) for side in (0, 1))
    slack = EQUAL * np.maximum(np.maximum(np.abs(low[0]), np.abs(high[0])), 1.0)
    found: list[tuple[int, ...]] = []
    for visited, order in enumerate(_walk(problem, total @ mix, mix, low, high, slack)):
        if len(order) == problem.n and np.allclose(problem.feature_sum(order), total, rtol=EQUAL, atol=EQUAL):
            if len(found) == cap:
                return found, False
            found.append(order)
        if visited == NODES:
            return found, False
    return found, True


def _walk(
    problem: SequencingProblem, target: Array, mix: Array, low: Array, high: Array, slack: Array
) -> Iterator[tuple[int, ...]]:
    """Every prefix whose remaining totals are still in reach, depth-first, lowest ids first."""
    stack: list[tuple[tuple[int, ...], int, Array]] = [((), 0, np.zeros(len(target)))]
    while stack:
        order, state, spent = stack.pop()
        yield order
        done = (state >> np.arange(problem.n) & 1).astype(np.bool_)
        step = problem.values(done[None, :])[0] @ mix
        for a in reversed(np.flatnonzero(~done).tolist()):
            after, total = state | 1 << a, spent + step[a]
            rest = target - total
            if (rest >= low[after] - slack).all() and (rest <= high[after] + slack).all():
                stack.append(((*order, a), after, total))
