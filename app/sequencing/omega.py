"""Omega (Eq. 3): all sequences with the same feature sum as a given one, counted exactly without listing them.

Prefixes that finish the same regions with the same totals go on alike, so they are one node of a graph; the ways through it are
the members. A node is dropped as soon as some remaining total is out of reach: for each feature alone, and for a few random
mixtures of them (which see what no single feature sees). What is within reach follows from the costs-to-go of the feature
taken as the cost, and of its negative.

Out of reach: more than MOST_REGIONS regions still to be ordered. With more than WIDEST nodes in a layer part of them are kept,
the given sequence's always, and the count is of those (`Nearly.complete`).
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from app.geometry.compiled import kernel
from app.geometry.tool import Array
from app.sequencing.answer import ROUNDING, magnitude
from app.sequencing.block import SMALLEST
from app.sequencing.constraints import Resolved
from app.sequencing.exact import Model, costs_to_go, form_for, model_for
from app.sequencing.forms import Ints
from app.sequencing.nearly import Nearly, lowest_to_end, ways_to_end
from app.sequencing.problem import CHUNK, SequencingProblem
from app.sequencing.rows import Single

EQUAL = 1e-9  # relative to the largest total of each quantity
SAME_NODE = 1e-3  # of that: totals this close are one node
MIXTURES = 4
MOST_REGIONS = 22  # the tables of what is within reach take 0.6 GB
WIDEST = 20_000  # nodes of a layer


@dataclass(frozen=True)
class Reach:
    """Totals of P quantities: asked for, and still possible from each set (those that don't depend on the region before)."""

    mix: Array  # (columns, P) quantities as mixtures of the features
    target: Array  # (P,)
    slack: Array  # (P,) difference that still counts as equal
    limited: tuple[int, ...]  # quantities with a row below
    low: list[Single]  # each (2^N',)
    high: list[Single]
    error: list[float]  # of both


@dataclass(frozen=True)
class Layer:
    """Nodes where equally many regions are finished."""

    state: Ints  # (M,)
    last: Ints  # (M,) region worked on last, -1 where it doesn't matter
    total: Array  # (M, P)


def equal_sums(problem: SequencingProblem, order: tuple[int, ...], resolved: Resolved) -> Nearly | None:
    """The graph of Omega over the free regions; its costs are all zero. None where it is out of reach.

    Args:
        problem: The tool and its features.
        order: The given sequence, of all regions; starts with those that are done.
        resolved: What members must respect besides.
    """
    n, free = len(resolved.free), np.array(resolved.free, np.int64)
    if n > MOST_REGIONS:
        return None
    model = model_for(problem, resolved)
    rest = problem.steps_of(order)[len(resolved.done) :].sum(axis=0)
    reach = _reach(problem, model, rest)
    before_first = resolved.done[-1] if resolved.done else -1
    layer = Layer(np.zeros(1, np.int64), np.array([before_first]), np.zeros((1, len(reach.target))))
    given = np.cumsum(np.int64(1) << np.array([resolved.free.index(a) for a in order[len(resolved.done) :]], np.int64))
    edges, region, to, nodes, complete = list[Ints](), list[Ints](), list[Ints](), 0, True
    for depth in range(n):
        width, (source, a, following) = len(layer.state), _steps(problem, model, reach, layer, free, final=depth == n - 1)
        target, layer = _merged(following, reach)
        if len(layer.state) > WIDEST:
            source, a, target, layer = _narrowed(source, a, target, layer, int(given[depth]))
            complete = False
        nodes += width
        edges.append(np.bincount(source, minlength=width))
        region.append(a)
        to.append(target + nodes)
    edges.append(np.zeros(len(layer.state), np.int64))
    first = np.concatenate([[0], np.cumsum(np.concatenate(edges))])
    regions, to_ = (np.concatenate([np.zeros(0, np.int64), *x]) for x in (region, to))
    cost = np.zeros(len(regions))
    return Nearly(first, regions, cost, to_, nodes, n, complete, lowest_to_end(first, cost, to_, nodes))


def _reach(problem: SequencingProblem, model: Model, rest: Array) -> Reach:
    """Each feature alone and random mixtures, all scaled by the size of the total asked for."""
    width, columns = problem.width, len(rest)
    drawn = np.zeros((columns, MIXTURES))
    drawn[:width] = np.random.default_rng(0).normal(size=(width, MIXTURES))  # fixed: the same pruning everywhere
    mix = np.hstack([np.eye(columns), drawn]) / np.maximum(np.abs(rest), 1e-3)[:, None]
    limited = tuple(p for p in range(mix.shape[1]) if p < width or p >= columns)
    low, high, error, largest = [], [], [], np.ones(mix.shape[1])
    for p, f in enumerate(problem.last, width):
        largest[p] = max(1.0, float(np.abs(f.between).max(initial=0.0)) * model.n * mix[p, p])
    for p in limited:
        w = mix[:width, p].copy()
        form = form_for(model, w)
        most = magnitude(form)
        largest[p] = max(1.0, most)
        error.append(ROUNDING * most)
        if model.n >= SMALLEST:
            low.append(costs_to_go(model, form))
            high.append(-costs_to_go(model, form_for(model, -w)))
    return Reach(mix, rest @ mix, EQUAL * largest, limited, low, high, error)


def _steps(problem: SequencingProblem, model: Model, reach: Reach, layer: Layer, free: Ints, final: bool) -> tuple[Ints, Ints, Layer]:
    """All ways on from the nodes of a layer that leave the rest within reach: from where, by which region, and to what."""
    found = [_steps_from(problem, model, reach, layer, slice(i, i + CHUNK), free, final) for i in range(0, max(len(layer.state), 1), CHUNK)]
    source, a = np.concatenate([f[0] for f in found]), np.concatenate([f[1] for f in found])
    state, last, total = (np.concatenate([getattr(f[2], name) for f in found]) for name in ("state", "last", "total"))
    return source, a, Layer(state, last, total)


def _steps_from(
    problem: SequencingProblem, model: Model, reach: Reach, layer: Layer, part: slice, free: Ints, final: bool
) -> tuple[Ints, Ints, Layer]:
    state, last, n, width = layer.state[part], layer.last[part], len(free), problem.width
    resolved, bits = model.resolved, np.int64(1) << np.arange(n)
    different, which = np.unique(state, return_inverse=True)
    done = np.zeros((len(different), problem.n), np.bool_)
    done[:, list(resolved.done)] = True
    done[:, free] = (different[:, None] & bits) != 0
    step = (problem.values(done)[:, free] @ reach.mix[:width])[which]
    for p, f in enumerate(problem.last, width):
        step += np.where(last[:, None] < 0, f.start[free], f.between[last][:, free])[..., None] * reach.mix[p]
    allowed = ((state[:, None] & bits) == 0) & ((model.prepared.before & ~state[:, None]) == 0)
    if resolved.parted:
        allowed &= (last[:, None] < 0) | ~resolved.never_next[last][:, free]
    source, a = np.nonzero(allowed)
    total, after = layer.total[part][source] + step[source, a], state[source] | bits[a]
    keep = _within(reach, after, reach.target - total, final)
    source, a, total, after = source[keep], a[keep], total[keep], after[keep]
    matters = bool(problem.last) or resolved.parted
    return source + (part.start or 0), a, Layer(after, free[a] if matters else np.full(len(a), -1), total)


def _within(reach: Reach, state: Ints, rest: Array, final: bool) -> NDArray[np.bool_]:
    """Whether what is left to a total can still come about."""
    if final:
        return np.all(np.abs(rest) <= reach.slack, axis=1)
    keep = np.ones(len(state), np.bool_)
    for p, low, high, error in zip(reach.limited, reach.low, reach.high, reach.error, strict=False):
        keep &= (rest[:, p] >= low[state] - error) & (rest[:, p] <= high[state] + error)
    return keep


def _merged(layer: Layer, reach: Reach) -> tuple[Ints, Layer]:
    """Equal nodes made one; where each went."""
    totals = np.round(layer.total / (SAME_NODE * reach.slack)).astype(np.int64)
    keys = np.column_stack([layer.state, layer.last, totals])
    _, chosen, where = np.unique(keys, axis=0, return_index=True, return_inverse=True)
    return where.reshape(-1), Layer(layer.state[chosen], layer.last[chosen], layer.total[chosen])


def _narrowed(source: Ints, a: Ints, target: Ints, layer: Layer, given: int) -> tuple[Ints, Ints, Ints, Layer]:
    """WIDEST nodes evenly from the layer, those of the given sequence's set among them, and the ways there."""
    even = np.linspace(0, len(layer.state) - 1, WIDEST).astype(np.int64)
    keep = np.unique(np.concatenate([even, np.flatnonzero(layer.state == given)[:WIDEST]]))
    place = np.full(len(layer.state), -1)
    place[keep] = np.arange(len(keep))
    stays = place[target] >= 0
    kept = Layer(layer.state[keep], layer.last[keep], layer.total[keep])
    return source[stays], a[stays], place[target[stays]], kept


def one_per_ends(graph: Nearly) -> Iterator[tuple[int, ...]]:
    """One member for every first and last region that members have."""
    lasts = _last_regions(graph.first, graph.region, graph.to, graph.to_go, graph.end)
    for a, node in graph.tied(0, 0.0):
        ends = [b for b in range(graph.n) if node < graph.end and lasts[node] >> b & 1]
        for b in ends or [a]:
            yield (a, *_way_to(graph, lasts, node, b))


def _way_to(graph: Nearly, lasts: Ints, node: int, b: int) -> Iterator[int]:
    while node < graph.end:
        a, node = next((a, to) for a, to in graph.tied(node, 0.0) if (a == b if to >= graph.end else lasts[to] >> b & 1))
        yield a


@kernel(nogil=True)
def _last_regions(first: Ints, region: Ints, to: Ints, to_go: Array, end: int) -> Ints:
    """Bit mask of the regions that sequences from each node may end with."""
    out = np.zeros(len(first), np.int64)
    for i in range(end - 1, -1, -1):
        for e in range(first[i], first[i + 1]):
            if to_go[to[e]] < np.inf:
                out[i] |= 1 << region[e] if to[e] >= end else out[to[e]]
    return out


def drawn_members(graph: Nearly, count: int) -> list[tuple[int, ...]]:
    """Members drawn evenly, repeated ones left out; the same every time."""
    ways = ways_to_end(graph.first, graph.cost, graph.to, graph.to_go, graph.end, 0.0).astype(np.float64) @ np.array([2.0**64, 1.0])
    generator, found = np.random.default_rng(0), dict[tuple[int, ...], None]()
    for _ in range(count):
        order, node = [], 0
        while node < graph.end:
            options = list(graph.tied(node, 0.0))
            share = np.cumsum([ways[to] for _, to in options])
            a, node = options[int(np.searchsorted(share, generator.random() * share[-1], side="right"))]
            order.append(a)
        found[tuple(order)] = None
    return list(found)
