"""The part of the state graph that nearly cheapest sequences pass through, written out with exact costs.

The kernels fill V in single precision; here every transition that can belong to a sequence of at most `limit` is costed again
in double precision, forwards from the start, layer by layer. What is asked about sequences (which, how many, all of one cost,
the next costs) is answered on this graph, which is small unless nearly everything ties.

A node is a state, or a state and the region worked on last where costs depend on it. Its edges are stored side by side.
"""

# pyright: reportReturnType=false, reportArgumentType=false
# Compiled code: the checker can't follow the types of the growing arrays.

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from app.geometry.compiled import kernel
from app.geometry.tool import Array
from app.sequencing.forms import Form, Ints, step_costs

Counts = NDArray[np.uint64]  # (..., 2) high and low 64 bits


@dataclass(frozen=True)
class Nearly:
    """Nodes in the order of work: edges only lead to later nodes."""

    first: Ints  # (M + 1,) edges of node i are first[i] .. first[i + 1] - 1
    region: Ints  # (E,)
    cost: Array  # (E,)
    to: Ints  # (E,)
    end: int  # nodes from here on are final: every region finished
    n: int  # regions ordered
    complete: bool  # False: too many nodes; those of each layer with the cheapest ways through them are kept
    to_go: Array  # (M,) cheapest cost to a final node; infinite where there is none

    @property
    def lowest(self) -> float:
        return float(self.to_go[0])

    def count(self, tolerance: float) -> int:
        """Number of cheapest sequences."""
        high, low = ways_to_end(self.first, self.cost, self.to, self.to_go, self.end, tolerance)[0]
        return (int(high) << 64) + int(low)

    def tied(self, node: int, tolerance: float) -> Iterator[tuple[int, int]]:
        """(region, next node) of the cheapest ways on, lowest region first."""
        for e in range(self.first[node], self.first[node + 1]):
            if self.cost[e] + self.to_go[self.to[e]] <= self.to_go[node] + tolerance:
                yield int(self.region[e]), int(self.to[e])

    def members(self, tolerance: float, cap: int) -> list[tuple[int, ...]]:
        """Cheapest sequences, lowest ids first, at most `cap`."""
        found: list[tuple[int, ...]] = []
        stack: list[tuple[tuple[int, ...], int]] = [((), 0)]
        while stack and len(found) < cap:
            order, node = stack.pop()
            if node >= self.end:
                found.append(order)
            else:
                stack.extend(((*order, a), to) for a, to in reversed(list(self.tied(node, tolerance))))
        return found

    def by_ends(self, start: Array, end: Array, tolerance: float) -> tuple[int, ...]:
        """The cheapest sequence with the least start[first region] + end[last region]; among these the lowest ids."""
        best = _least_end(self.first, self.region, self.cost, self.to, self.to_go, self.end, end, tolerance)
        order, node = [], 0
        while node < self.end:
            options = [(start[a] * (node == 0) + (end[a] if to >= self.end else best[to]), a, to) for a, to in self.tied(node, tolerance)]
            least = min(value for value, _, _ in options)
            slack = 1e-12 * (abs(least) + np.abs(start).max() + np.abs(end).max())
            _, a, node = next(o for o in options if o[0] <= least + slack)
            order.append(a)
        return tuple(order)

    def classes(self, k: int, tolerance: float) -> list[tuple[float, int, tuple[int, ...]]]:
        """Total, number of sequences and a representative of the k cheapest distinct totals in this graph."""
        totals, counts, filled = _classes(self.first, self.cost, self.to, self.end, k, tolerance)
        found = []
        for j in range(filled[0]):
            high, low = counts[0, j]
            found.append((float(totals[0, j]), (int(high) << 64) + int(low), self._opener(totals, filled, j)))
        return found

    def _opener(self, totals: Array, filled: Ints, which: int) -> tuple[int, ...]:
        """The sequence that opened class `which`: its total was computed from these very numbers."""
        order, node = [], 0
        while node < self.end:
            edges = range(self.first[node], self.first[node + 1])
            options = (
                (abs(self.cost[e] + totals[self.to[e], q] - totals[node, which]), e, q) for e in edges for q in range(filled[self.to[e]])
            )
            _, e, which = min(options)
            order.append(int(self.region[e]))
            node = int(self.to[e])
        return tuple(order)


def explore(form: Form, v: NDArray[np.float32], after_last: Array, limit: float, most: int) -> Nearly:
    """The graph of all sequences of at most `limit`.

    Args:
        form: The cost.
        v: Cheapest costs-to-go (2^N,), (2^N * N,) by last region with `after_last`, or empty: then nothing is pruned.
        after_last: (N + 1, N) what region a adds after region b, the last row at the start; (0, 0) where nothing depends on it.
        limit: Includes the rounding error of v.
        most: Nodes; with more the graph is of no use.
    """
    n = form.start.shape[1]
    first, region, cost, to, end, complete = explore_compiled(form, v, after_last, limit, most, 0)
    return Nearly(first, region, cost, to, end, n, complete, lowest_to_end(first, cost, to, end))


@kernel(nogil=True)
def explore_compiled(
    form: Form, v: NDArray[np.float32], after_last: Array, limit: float, most: int, widest: int
) -> tuple[Ints, Ints, Array, Ints, int, bool]:
    """`explore`; with `widest` at most so many nodes per layer are kept, and never given up."""
    n = form.start.shape[1]
    by_last = len(after_last) > 0
    stride = n if by_last else 1
    size, edges = 64 * n, 0
    region, cost, to, reach = np.empty(size, np.int64), np.empty(size), np.empty(size, np.int64), np.empty(size)
    first = [0]
    here, so_far, out = np.zeros(1, np.int64), np.zeros(1), np.empty(n)
    nodes = 0
    for depth in range(n):
        begin = edges
        for i in range(len(here)):
            s = here[i] // stride
            last = n if depth == 0 else here[i] % stride
            step_costs(form, s, out)
            if edges + n > size:
                size *= 2
                region, cost, to, reach = _longer(region, size), _longer(cost, size), _longer(to, size), _longer(reach, size)
            for a in range(n):
                c = out[a]
                if by_last and c < np.inf:
                    c += after_last[last, a]
                if c == np.inf:
                    continue
                key = (s | 1 << a) * stride + (a if by_last else 0)
                if len(v) and not so_far[i] + c + v[key] <= limit:
                    continue
                region[edges], cost[edges], to[edges], reach[edges] = a, c, key, so_far[i] + c
                edges += 1
            first.append(edges)
        before, nodes = nodes, nodes + len(here)
        here = np.unique(to[begin:edges]) if edges > begin + 1 else to[begin:edges].copy()
        if widest and len(here) > widest:
            here = _cheapest(here, v, to[begin:edges], reach[begin:edges], widest)
            edges = _only(here, first, before, begin, region, cost, to, reach)
        elif not widest and nodes + len(here) > most:
            return np.array(first), region[:0], cost[:0], to[:0], nodes, False
        so_far = np.full(len(here), np.inf)
        for e in range(begin, edges):
            i = np.searchsorted(here, to[e])
            so_far[i] = min(so_far[i], reach[e])
            to[e] = nodes + i
    end = nodes
    for _ in range(max(len(here), 1)):
        first.append(edges)
    return np.array(first), region[:edges].copy(), cost[:edges].copy(), to[:edges].copy(), end, True


@kernel(nogil=True)
def _cheapest(keys: Ints, v: NDArray[np.float32], to: Ints, reach: Array, widest: int) -> Ints:
    """The keys with the cheapest ways through them, in order."""
    through = np.full(len(keys), np.inf)
    for e in range(len(to)):
        i = np.searchsorted(keys, to[e])
        through[i] = min(through[i], reach[e] + v[to[e]])
    return keys[np.sort(np.argsort(through, kind="mergesort")[:widest])]


@kernel(nogil=True)
def _only(keys: Ints, first: list[int], node: int, begin: int, region: Ints, cost: Array, to: Ints, reach: Array) -> int:
    """Drop the edges of the nodes from `node` on that lead to none of the keys; returns how many edges there are then."""
    read, write = begin, begin
    for i in range(node, len(first) - 1):
        for e in range(read, first[i + 1]):
            at = np.searchsorted(keys, to[e])
            if at < len(keys) and keys[at] == to[e]:
                region[write], cost[write], to[write], reach[write] = region[e], cost[e], to[e], reach[e]
                write += 1
        read, first[i + 1] = first[i + 1], write
    return write


@kernel(nogil=True)
def _longer(values, size):  # type: ignore[no-untyped-def]
    out = np.empty(size, values.dtype)
    out[: len(values)] = values
    return out


@kernel(nogil=True)
def lowest_to_end(first: Ints, cost: Array, to: Ints, end: int) -> Array:
    """Cheapest cost from every node to a final one."""
    v = np.full(max(len(first) - 1, end), np.inf)
    v[end:] = 0.0
    for i in range(end - 1, -1, -1):
        for e in range(first[i], first[i + 1]):
            v[i] = min(v[i], cost[e] + v[to[e]])
    return v


@kernel(nogil=True)
def _add(sum_: Counts, more: Counts) -> None:
    """sum_ += more, 128 bits: 28! fits."""
    low = sum_[1] + more[1]
    sum_[0] += more[0] + (np.uint64(1) if low < sum_[1] else np.uint64(0))
    sum_[1] = low


@kernel(nogil=True)
def ways_to_end(first: Ints, cost: Array, to: Ints, v: Array, end: int, tolerance: float) -> Counts:
    """Number of cheapest ways on from every node."""
    ways = np.zeros((len(v), 2), np.uint64)
    ways[end:, 1] = 1
    for i in range(end - 1, -1, -1):
        for e in range(first[i], first[i + 1]):
            if cost[e] + v[to[e]] <= v[i] + tolerance:
                _add(ways[i], ways[to[e]])
    return ways


@kernel(nogil=True)
def lowest_order(first: Ints, region: Ints, cost: Array, to: Ints, v: Array, end: int, tolerance: float) -> Ints:
    """The cheapest sequence with the lowest region ids; empty when there is none."""
    order, length, node = np.empty(64, np.int64), 0, 0
    while node < end and v[0] < np.inf:
        for e in range(first[node], first[node + 1]):
            if cost[e] + v[to[e]] <= v[node] + tolerance:
                order[length] = region[e]
                length, node = length + 1, to[e]
                break
    return order[:length].copy()


@kernel(nogil=True)
def _least_end(first: Ints, region: Ints, cost: Array, to: Ints, v: Array, end: int, penalty: Array, tolerance: float) -> Array:
    """Least penalty of the last region over the cheapest ways on from every node."""
    best = np.full(len(v), np.inf)
    for i in range(end - 1, -1, -1):
        for e in range(first[i], first[i + 1]):
            if cost[e] + v[to[e]] <= v[i] + tolerance:
                best[i] = min(best[i], penalty[region[e]] if to[e] >= end else best[to[e]])
    return best


@kernel(nogil=True)
def _classes(first: Ints, cost: Array, to: Ints, end: int, k: int, tolerance: float) -> tuple[Array, Counts, Ints]:
    """The k lowest distinct totals from every node: a k-way merge of the sorted lists of its successors.

    A total joins the class opened below it when within the tolerance.
    """
    m = len(first) - 1
    totals, counts, filled = np.empty((m, k)), np.zeros((m, k, 2), np.uint64), np.zeros(m, np.int64)
    totals[end:, 0], filled[end:] = 0.0, 1
    counts[end:, 0, 1] = 1
    head = np.zeros(128, np.int64)
    for i in range(end - 1, -1, -1):
        edges = first[i + 1] - first[i]
        head[:edges] = 0
        while True:
            value, who = np.inf, -1
            for j in range(edges):
                e = first[i] + j
                if head[j] < filled[to[e]]:
                    x = cost[e] + totals[to[e], head[j]]
                    if x < value:
                        value, who = x, j
            if who < 0:
                break
            t = to[first[i] + who]
            if filled[i] and value - totals[i, filled[i] - 1] <= tolerance:
                _add(counts[i, filled[i] - 1], counts[t, head[who]])
            elif filled[i] == k:
                break
            else:
                totals[i, filled[i]] = value
                counts[i, filled[i]] = counts[t, head[who]]
                filled[i] += 1
            head[who] += 1
    return totals, counts, filled
