"""From weights to the cheapest sequence in one compiled call: at few regions the way between Python and compiled code costs
more than the search.

    weigh the declared columns -> costs-to-go in single precision (`block`) -> the graph of nearly cheapest sequences in double
    precision (`nearly`) -> number of ties, and of the tied sequences the one with the lowest region ids
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from app.geometry.compiled import kernel
from app.geometry.tool import Array
from app.sequencing.block import LOW, fill
from app.sequencing.forms import BETWEEN, Form, Ints, Shape, step_costs, weigh
from app.sequencing.nearly import explore_compiled, lowest_order, lowest_to_end, ways_to_end
from app.sequencing.rows import Single, lay_out

TOLERANCE = 1e-7  # relative: costs closer than this count as equal
ROUNDING = 4e-6  # error of single-precision costs-to-go, as a share of the largest sum of absolute costs
TOP_BITS = 8  # superblocks that threads share
MOST_NODES = 2_000_000  # of the graph
PART = 100  # where there are more, each layer keeps this part of them


class Prepared(NamedTuple):
    """What a tool's search needs whatever the weights; n columns, m interactions, N regions still to be ordered."""

    shape: Shape
    undeclared: NDArray[np.bool_]  # (n,)
    factors: Array  # (F - 1, n) columns that each factor of an interaction adds up
    pair: Ints  # (P, 2) factors of each declared interaction
    products: Ints  # (P,) its column
    empty: Array  # (N, n + m) values where nothing is finished
    before: Ints  # (N,) bit masks of what must be finished first
    sets: Single  # (G', 2^N) values of sets
    row: Ints  # (G,)
    flip: NDArray[np.bool_]  # (G,)


class Answer(NamedTuple):
    """The graph of nearly cheapest sequences, and what is asked of it most."""

    first: Ints
    region: Ints
    cost: Array
    to: Ints
    end: int
    complete: bool  # False: only part of it
    to_go: Array
    order: Ints  # the cheapest sequence
    high: int  # number of sequences that tie with it, in two 64-bit halves
    low: int
    scale: float  # cost that relative tolerances refer to
    error: float  # of the costs-to-go


@kernel(nogil=True)
def weighed(p: Prepared, w: Array, extra: Array) -> Form:
    """The cost under weights w (n + m,); `extra` (N, 2^N) is what undeclared columns add, (0, 0) without."""
    f, c = p.factors.shape
    mix, weight, first = np.empty((f + 1, c)), np.empty(len(p.products)), np.zeros(len(p.empty))
    for j in range(c):
        mix[0, j] = 0.0 if p.undeclared[j] else w[j]
    mix[1:] = p.factors
    for k in range(len(weight)):
        weight[k] = w[p.products[k]]
    for a in range(len(first)):
        for j in range(len(w)):
            first[a] += p.empty[a, j] * w[j]
    return weigh(p.shape, mix, p.pair, weight, p.before, first, extra)


@kernel(nogil=True)
def laid_out(p: Prepared, form: Form):  # type: ignore[no-untyped-def]
    """The form as the block kernel reads it."""
    high = form.start.shape[1] - LOW
    top = min(TOP_BITS, (high + 1) // 2)
    return lay_out(form, high - top, top, p.row, p.flip)


@kernel(nogil=True)
def answer(p: Prepared, w: Array, extra: Array, after: Array, v: Single, filled: bool, most: int) -> Answer:
    """The cheapest sequence.

    Args:
        p: The tool.
        w: Weights of all columns that don't depend on the region before.
        extra: As for `weighed`.
        after: As for `nearly.explore`.
        v: Costs-to-go, by last region with `after`, empty for very few regions; worked out here unless `filled`.
        filled: v is known.
        most: Nodes of the graph.
    """
    form = weighed(p, w, extra)
    bound = magnitude(form)
    for b in range(len(after)):
        for a in range(len(after[0])):
            bound += abs(after[b, a]) if np.isfinite(after[b, a]) else 0.0
    limit, error = np.inf, ROUNDING * bound
    if len(v):
        if not filled:
            fill(laid_out(p, form), p.sets, v)
        limit = lowest_cost(form, after, v) + error
    first, region, cost, to, end, complete = explore_compiled(form, v, after, limit, most, 0)
    if not complete:
        first, region, cost, to, end, _ = explore_compiled(form, v, after, limit, most, most // PART)
    to_go = lowest_to_end(first, cost, to, end)
    scale = max(abs(to_go[0]) if np.isfinite(to_go[0]) else 0.0, 1e-3 * bound, 1e-300)
    ways = ways_to_end(first, cost, to, to_go, end, TOLERANCE * scale)[0]
    order = lowest_order(first, region, cost, to, to_go, end, TOLERANCE * scale)
    return Answer(first, region, cost, to, end, complete, to_go, order, ways[0], ways[1], scale, error)


@kernel(nogil=True)
def lowest_cost(form: Form, after: Array, v: Single) -> float:
    """Cheapest cost of a complete sequence, to single precision."""
    n = form.start.shape[1]
    costs, least = np.empty(n), np.inf
    step_costs(form, 0, costs)
    for a in range(n):
        if len(after):
            least = min(least, costs[a] + after[n, a] + v[(1 << a) * n + a])
        else:
            least = min(least, costs[a] + v[1 << a])
    return least


@kernel(nogil=True)
def magnitude(form: Form) -> float:
    """What no sum of absolute costs along a sequence exceeds: rounding errors are measured against it."""
    f, n = form.start.shape
    mean, of_set, bound, total = np.zeros(len(form.averaged)), np.zeros(f), np.empty(f), 0.0
    for q in range(len(mean)):
        for b in range(n):
            mean[q] = max(mean[q], abs(form.averaged[q, b]))
        mean[q] = max(mean[q], abs(form.total[q]) / max(form.count, 1))
    for g in range(form.state.shape[1]):
        largest = 1.0
        if form.values.kind[g] == BETWEEN:
            largest = np.abs(form.values.matrix[g]).sum()
        for i in range(f):
            of_set[i] += abs(form.state[i, g]) * largest
    for a in range(n):
        for i in range(f):
            bound[i] = of_set[i] + _largest(form, i, a, mean)
        cost = max(bound[0], abs(form.first[a]))
        for p in range(len(form.weight)):
            cost += abs(form.weight[p]) * bound[form.pair[p, 0]] * bound[form.pair[p, 1]]
        largest = 0.0
        for s in range(form.extra.shape[1]):
            if not s >> a & 1:
                largest = max(largest, abs(form.extra[a, s]))
        total += cost + largest
    return total


@kernel(nogil=True)
def _largest(form: Form, i: int, a: int, mean: Array) -> float:
    """What |F_i| of region a can't exceed without values of sets; `mean` (Q,) is what no mean exceeds."""
    n = form.start.shape[1]
    x, rank = abs(form.start[i, a]), 0.0
    for b in range(n):
        x += abs(form.change[i, a, b])
        rank = max(rank, abs(form.rank[i, b, a]))
    for u in range(len(form.reached)):
        touch = 0.0
        for k in range(4):
            touch = max(touch, abs(form.touch[i, u, k]))
        x += touch
    for t in range(len(form.of)):
        x += abs(form.slope[i, t]) * (abs(form.own[t, a]) + mean[form.of[t]])
    for q in range(len(mean)):
        x += abs(form.drift[i, q]) * mean[q]
    return x + rank
