"""The soft dynamic program over listed transitions: all of a tool's sets, or the part of them where likely orders run.

`soft_program` walks a table of all sets and regions, which is quickest up to 14 regions. Here the transitions are listed one after
the other, which takes half the memory and works on any part of the sets too: every order through the kept sets then counts, and
nothing else.
"""

from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray

from app.learning.qp import Array
from app.sequencing.problem import SequencingProblem, sets_from

CHUNK = 1 << 12  # sets evaluated at a time
MOST_REGIONS = 62  # a set is the bits of one integer
SAME = 1e-6  # relative: costs from values in single precision this close are the same
WIDTH = 400  # sets of each size that are kept where not all can be

Ints = NDArray[np.int64]
Single = NDArray[np.float32]


@dataclass(frozen=True, eq=False)
class SoftGraph:
    """Transitions between sets of finished regions, sets in the order of their size or of their bits; the empty set is first."""

    n: int
    sets: Ints  # (S,) bits of the finished regions
    start: Ints  # (S + 1,) transitions from set s are start[s] up to start[s + 1]
    to: NDArray[np.int32]  # (E,) set that is reached
    region: NDArray[np.int8]  # (E,)
    values: Single  # (E, F) features in their units
    whole: bool  # all sets are listed: sums over all orders are exact


def whole_graph(problem: SequencingProblem, unit: Array) -> SoftGraph:
    """All 2^N sets; the list of N 2^(N - 1) transitions takes 460 MB for 20 regions and 11 features.

    Args:
        problem: The tool.
        unit: (F,) what a feature is multiplied with.
    """
    n = problem.n
    sets = np.arange(1 << n, dtype=np.int64)
    open_ = n - np.bitwise_count(sets).astype(np.int64)
    start = np.r_[0, np.cumsum(open_)]
    to, region = np.empty(start[-1], np.int32), np.empty(start[-1], np.int8)
    values = np.empty((start[-1], len(unit)), np.float32)
    for first in range(0, 1 << n, CHUNK):
        done = sets_from(first, CHUNK, n)
        rows, regions = np.nonzero(~done)
        here = slice(start[first], start[first] + len(rows))
        to[here], region[here] = (first + rows) | (np.int64(1) << regions), regions
        values[here] = problem.values(done)[rows, regions] * unit
    return SoftGraph(n, sets, start, to, region, values, True)


def part_graph(problem: SequencingProblem, unit: Array, w: Array, through: tuple[tuple[int, ...], ...], width: int = WIDTH) -> SoftGraph:
    """The sets of each size that orders reach with most probability under w, and those around some orders.

    Args:
        problem: A tool of at most `MOST_REGIONS` regions.
        unit: (F,) what a feature is multiplied with.
        w: (F,) weights of features in their units.
        through: Orders whose sets are kept, with every set that differs from one of them in a single region.
        width: Sets of each size beside these.
    """
    n = problem.n
    none = np.zeros(0, np.int64)
    around = [np.unique(np.concatenate([none, *(_around(order, size, n) for order in through)])) for size in range(n + 1)]
    layers, tables, reached = [np.zeros(1, np.int64)], [], np.zeros(1)
    for size in range(n):
        here = layers[-1]
        done = (here[:, None] >> np.arange(n)) & 1 == 1
        rows, regions = np.nonzero(~done)
        values = (problem.values(done)[rows, regions] * unit).astype(np.float32)
        after = here[rows] | (np.int64(1) << regions)
        found, place = np.unique(after, return_inverse=True)
        mass = np.full(len(found), -np.inf)
        np.logaddexp.at(mass, place.ravel(), reached[rows] - values @ w)
        kept = np.isin(found, around[size + 1])
        kept[np.argsort(-mass, kind="stable")[:width]] = True
        tables.append((rows, regions, after, values))
        layers.append(found[kept])
        reached = mass[kept]
    return _linked(n, layers, tables)


def _around(order: tuple[int, ...], size: int, n: int) -> Ints:
    """The set of the first regions of an order, and those with one of them exchanged for another."""
    inside, outside = order[:size], order[size:]
    own = np.int64(sum(1 << a for a in inside))
    return np.array([own, *(own ^ np.int64(1 << a) ^ np.int64(1 << b) for a in inside for b in outside)], np.int64)


def _linked(n: int, layers: list[Ints], tables: list[tuple[Ints, Ints, Ints, Single]]) -> SoftGraph:
    """Sets from which the full one can't be reached are left out."""
    alive = [np.ones(1, np.bool_)]
    for size in range(n - 1, -1, -1):
        rows, _, after, _ = tables[size]
        good = np.zeros(len(layers[size]), np.bool_)
        good[rows[np.isin(after, layers[size + 1][alive[0]])]] = True
        alive.insert(0, good)
    kept = [layer[mask] for layer, mask in zip(layers, alive, strict=True)]
    offset = np.r_[0, np.cumsum([len(k) for k in kept])]
    starts, to, region, values = [np.zeros(1, np.int64)], [], [], []
    for size, (rows, regions, after, value) in enumerate(tables):
        use = alive[size][rows] & np.isin(after, kept[size + 1])
        place = np.cumsum(alive[size]) - 1
        counts = np.bincount(place[rows[use]], minlength=len(kept[size]))
        starts.append(starts[-1][-1] + np.cumsum(counts))
        to.append((offset[size + 1] + np.searchsorted(kept[size + 1], after[use])).astype(np.int32))
        region.append(regions[use].astype(np.int8))
        values.append(value[use])
    start = np.concatenate([*starts, starts[-1][-1:]])  # the full set has no transitions
    return SoftGraph(n, np.concatenate(kept), start, np.concatenate(to), np.concatenate(region), np.concatenate(values), False)


def to_go_of(graph: SoftGraph, w: Array) -> tuple[float, Array]:
    """-log of the sum of exp(-cost) over all orders, and the probability of each transition (E,)."""
    to_go, chosen = _to_go(graph.start, graph.to, graph.values, w.astype(np.float64))
    return float(to_go[0]), chosen


def expected_sums_of(graph: SoftGraph, chosen: Array) -> Array:
    """Expected feature sum (F,)."""
    return _expected(graph.start, graph.to, graph.values, chosen)


def covariance_of(graph: SoftGraph, chosen: Array) -> Array:
    """Covariance of the feature sums (F, F)."""
    return _covariance(graph.start, graph.to, graph.values, chosen)


def drawn_from(graph: SoftGraph, chosen: Array, uniform: Array) -> tuple[Ints, Array]:
    """Orders (M, N) drawn from `chosen`, one per row of uniform numbers (M, N), and their feature sums (M, F)."""
    return _drawn(graph.start, graph.to, graph.region, graph.values, chosen, uniform)


def cheapest_in(graph: SoftGraph, w: Array) -> tuple[tuple[int, ...], float, float]:
    """The cheapest listed order, its cost, and how many listed orders cost the same (values are in single precision)."""
    order, cost, ties = _cheapest(graph.start, graph.to, graph.region, graph.values, w.astype(np.float64), graph.n)
    return tuple(int(a) for a in order), cost, ties


@njit(cache=True)
def _cheapest(start: Ints, to: NDArray[np.int32], region: NDArray[np.int8], values: Single, w: Array, n: int) -> tuple[Ints, float, float]:
    states, size = len(start) - 1, len(w)
    lowest, ties, way = np.zeros(states), np.ones(states), np.zeros(states, np.int64)
    for s in range(states - 2, -1, -1):
        lowest[s], ties[s] = np.inf, 0.0
        for e in range(start[s], start[s + 1]):
            cost = lowest[to[e]]
            for k in range(size):
                cost += values[e, k] * w[k]
            slack = SAME * (1.0 + abs(cost))
            if cost < lowest[s] - slack:
                lowest[s], ties[s], way[s] = cost, ties[to[e]], e
            elif cost <= lowest[s] + slack:
                ties[s] += ties[to[e]]
    order, s = np.empty(n, np.int64), 0
    for k in range(n):
        order[k] = region[way[s]]
        s = to[way[s]]
    return order, lowest[0], ties[0]


@njit(cache=True)
def _to_go(start: Ints, to: NDArray[np.int32], values: Single, w: Array) -> tuple[Array, Array]:
    states, size = len(start) - 1, len(w)
    to_go, chosen = np.zeros(states), np.empty(len(to))
    for s in range(states - 2, -1, -1):
        lowest = np.inf
        for e in range(start[s], start[s + 1]):
            cost = to_go[to[e]]
            for k in range(size):
                cost += values[e, k] * w[k]
            chosen[e] = cost
            lowest = min(lowest, cost)
        total = 0.0
        for e in range(start[s], start[s + 1]):
            chosen[e] = np.exp(lowest - chosen[e])
            total += chosen[e]
        for e in range(start[s], start[s + 1]):
            chosen[e] /= total
        to_go[s] = lowest - np.log(total)
    return to_go, chosen


@njit(cache=True)
def _expected(start: Ints, to: NDArray[np.int32], values: Single, chosen: Array) -> Array:
    states, size = len(start) - 1, values.shape[1]
    reached, total = np.zeros(states), np.zeros(size)
    reached[0] = 1.0
    for s in range(states - 1):
        if reached[s] > 0.0:
            for e in range(start[s], start[s + 1]):
                p = reached[s] * chosen[e]
                reached[to[e]] += p
                for k in range(size):
                    total[k] += p * values[e, k]
    return total


@njit(cache=True)
def _covariance(start: Ints, to: NDArray[np.int32], values: Single, chosen: Array) -> Array:
    """Variance of a choice's expected sum, added over all sets in proportion to how often they are reached (law of total variance)."""
    states, size = len(start) - 1, values.shape[1]
    mean, reached = np.zeros((states, size)), np.zeros(states)
    for s in range(states - 2, -1, -1):
        for e in range(start[s], start[s + 1]):
            for k in range(size):
                mean[s, k] += chosen[e] * (values[e, k] + mean[to[e], k])
    total, off = np.zeros((size, size)), np.empty(size)
    reached[0] = 1.0
    for s in range(states - 1):
        if reached[s] <= 0.0:
            continue
        for e in range(start[s], start[s + 1]):
            p = reached[s] * chosen[e]
            reached[to[e]] += p
            for k in range(size):
                off[k] = values[e, k] + mean[to[e], k] - mean[s, k]
            for j in range(size):
                for k in range(size):
                    total[j, k] += p * off[j] * off[k]
    return total


@njit(cache=True)
def _drawn(
    start: Ints, to: NDArray[np.int32], region: NDArray[np.int8], values: Single, chosen: Array, uniform: Array
) -> tuple[Ints, Array]:
    count, n = uniform.shape
    orders, sums = np.zeros((count, n), np.int64), np.zeros((count, values.shape[1]))
    for m in range(count):
        s = 0
        for step in range(n):
            left, pick = uniform[m, step], start[s + 1] - 1
            for e in range(start[s], start[s + 1]):
                left -= chosen[e]
                if left < 0:
                    pick = e
                    break
            orders[m, step] = region[pick]
            for k in range(values.shape[1]):
                sums[m, k] += values[pick, k]
            s = to[pick]
    return orders, sums


def warm_up() -> None:
    """Compile or load the kernels."""
    start, to = np.array([0, 1, 1]), np.ones(1, np.int32)
    values, region = np.zeros((1, 1), np.float32), np.zeros(1, np.int8)
    chosen = _to_go(start, to, values, np.zeros(1))[1]
    _expected(start, to, values, chosen)
    _covariance(start, to, values, chosen)
    _drawn(start, to, region, values, chosen, np.full((1, 1), 0.5))
    _cheapest(start, to, region, values, np.zeros(1), 1)
