"""Sequences of tools with more regions than the exact dynamic program can hold: best found, not proved.

Many starts (beams, and sweeps over the tool in plain patterns) descend by exact re-ordering of stretches; the best of them
then lose a few regions at a time and get them back where the whole is cheapest (`window.reinsert`), with a block moved
elsewhere whenever nothing has helped for a while. Costs that depend on the region before, and forbidden neighbours, are not
seen by a re-insertion; it is only kept when the whole cost with them has not grown.

Deterministic for a seed; the best order so far only ever gets cheaper.
"""

import itertools
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from heapq import heapify, heappop, heappush

import numpy as np

from app.errors import ContradictoryConstraints
from app.geometry.tool import Array, region_letters
from app.sequencing.beam import beam
from app.sequencing.constraints import Resolved, listed, resolve
from app.sequencing.problem import SequencingProblem
from app.sequencing.transitions import Model, is_compiled, model_of
from app.sequencing.window import Order, order_cost, reinsert, reinsert_by_values

ROUNDS = 5  # of moving blocks where costs depend on the region before
BLOCK = 3  # regions moved elsewhere together then
AVOIDING = 20_000  # starts of orders looked at for one without forbidden neighbours
IMPROVES = 1e-9  # relative gain below which a move counts as no improvement

Found = tuple[float, tuple[int, ...]]  # cost and order
Report = Callable[[float, float], None]  # (share of the budget used, cost of the best order so far)


@dataclass(frozen=True)
class Effort:
    """How long to search."""

    moves: int = 700  # re-insertions after the descents
    beams: tuple[int, ...] = (1, 10, 100)
    stretch: int = 8  # regions re-ordered at a time in a descent
    taken: int = 6  # regions taken out at a time afterwards
    reach: int = 24  # positions they are taken from
    patience: int = 60  # moves without gain before a block is moved
    kept: int = 3  # descents that are searched further
    sweeps: bool = True  # start from plain patterns as well


NORMAL = Effort()
SLOW = Effort(moves=60, beams=(10,), stretch=6, taken=4, reach=16, sweeps=False)  # for features that are not compiled


class Search:
    """One tool, one set of weights: costs of orders of the free regions, moves on them."""

    def __init__(self, problem: SequencingProblem, w: Array, resolved: Resolved, seed: int) -> None:
        self.n, self.rng = problem.n, np.random.default_rng(seed)
        self.problem, self.w = problem, w[: len(problem.features.columns) + len(problem.interactions)]
        self.model: Model | None = model_of(problem, self.w) if is_compiled(problem.features) else None
        self.between, self.start = between_costs(problem, w)
        self.before, self.never_next = resolved.before, resolved.never_next
        self.chained = bool(self.between.any() or self.start.any())  # costs depend on the region before
        self.done, self.free = np.zeros(problem.n, np.bool_), np.array(resolved.free, np.int64)
        self.done[list(resolved.done)] = True
        self.last_done = resolved.done[-1] if resolved.done else -1
        self.penalty = 1.0 + 10 * float(np.abs(w).sum()) * problem.n
        centre = (problem.graph.low + problem.graph.high) / 2
        self.near = np.argsort(((centre[:, None] - centre) ** 2).sum(axis=-1), axis=1, kind="stable")
        self.centre, self.height = centre, problem.graph.height

    def cost(self, order: Order) -> float:
        """The order's cost, plus a penalty for every forbidden neighbour."""
        extra = self.penalty * self.broken(order) + self.on_the_way(order)
        if self.model is not None:
            return float(order_cost(self.model, order, self.done)) + extra
        before = np.repeat(self.done[None, :], len(order), axis=0)
        before[:, order] = np.tri(len(order), k=-1, dtype=np.bool_)
        paid = (self.problem.values(before) @ self.w)[np.arange(len(order)), order]
        return float(paid.sum()) + extra

    def on_the_way(self, order: Order) -> float:
        """What depends on the region before."""
        first = self.start[order[0]] if self.last_done < 0 else self.between[self.last_done, order[0]]
        return float(first + self.between[order[:-1], order[1:]].sum())

    def broken(self, order: Order) -> int:
        """Pairs that must not follow each other but do."""
        chain = order if self.last_done < 0 else np.concatenate([[self.last_done], order])
        return int(self.never_next[chain[:-1], chain[1:]].sum())

    def reinsert(self, order: Order, start: int, stop: int, taken: Order) -> Order:
        """The best order that moves only the regions at the positions `taken`."""
        if self.model is None:
            return reinsert_by_values(self.problem, self.w, order, self.done, self.before, start, stop, taken)
        out = np.empty_like(order)
        reinsert(self.model, order, self.done, self.before, start, stop, taken, out)
        return out

    def allowed(self, order: Order) -> bool:
        """Whether every region comes after those that must precede it."""
        place = np.empty(self.n, np.int64)
        place[order] = np.arange(len(order))
        a, b = np.nonzero(self.before)
        return bool((place[a] < place[b]).all())

    def sorted_by(self, key: Array) -> Order:
        """The free regions by `key`, each as soon as those that must precede it are there."""
        blockers, order = self.before[self.free].sum(axis=0), []
        ready = [(float(key[a]), int(a)) for a in self.free if not blockers[a]]
        heapify(ready)
        while ready:
            order.append(heappop(ready)[1])
            for b in np.flatnonzero(self.before[order[-1]]).tolist():
                blockers[b] -= 1
                if not blockers[b]:
                    heappush(ready, (float(key[b]), b))
        return np.array(order, np.int64)

    def sweeps(self) -> Iterator[Order]:
        """Row by row and column by column from every corner, to and fro, by height, and from the middle outwards."""
        x, y = ((self.centre - self.centre.min(axis=0)) / np.maximum(np.ptp(self.centre, axis=0), 1e-12)).T
        for along, across in ((x, y), (y, x)):
            band = np.round(across, 3)
            lane = np.unique(band, return_inverse=True)[1]
            for lanes in (lane, lane.max() - lane):
                for way in (along, 1 - along):
                    yield self.sorted_by(lanes * 10 + way)
                    yield self.sorted_by(lanes * 10 + np.where(lanes % 2, 1 - way, way))
        yield self.sorted_by(self.height)
        yield self.sorted_by(-self.height)
        yield self.sorted_by((x - 0.5) ** 2 + (y - 0.5) ** 2)

    def descend(self, order: Order, size: int) -> tuple[float, Order]:
        """Re-order stretches of `size` regions exactly, over and over, until a whole sweep gains nothing."""
        size = min(size, len(order))
        starts = sorted({*range(0, len(order) - size + 1, max(1, size // 2)), len(order) - size})
        cost = self.cost(order)
        while True:
            before = cost
            for start in starts:
                trial = self.reinsert(order, start, start + size, np.arange(start, start + size))
                value = cost if np.array_equal(trial, order) else self.cost(trial)
                if value < cost:
                    cost, order = value, trial
            if cost > before - IMPROVES * max(1e-300, abs(before)):
                return cost, order

    def relocated(self, cost: float, order: Order) -> tuple[float, Order]:
        """Blocks of up to BLOCK regions moved elsewhere while the whole cost falls: sees what re-insertion can't."""
        n = len(order)
        for _ in range(ROUNDS):
            before = cost
            for i, size in itertools.product(range(n), range(1, min(BLOCK, n) + 1)):
                block, rest = order[i : i + size], np.concatenate([order[:i], order[i + size :]])
                for at in range(len(rest) + 1):
                    trial = np.concatenate([rest[:at], block, rest[at:]])
                    value = self.cost(trial)
                    if value < cost - IMPROVES * abs(cost) and self.allowed(trial):
                        cost, order = value, trial
                        break
            if cost == before:
                break
        return cost, order

    def move(self, order: Order, effort: Effort) -> Order:
        """Take some regions out, near each other in the order or on the tool, and put them back best."""
        n, kind = len(order), self.rng.random()
        k = min(effort.taken, n)
        if kind < 0.35:
            reach = min(effort.reach, n)
            start = int(self.rng.integers(n - reach + 1))
            return self.reinsert(order, start, start + reach, start + np.sort(self.rng.choice(reach, k, replace=False)))
        if kind < 0.6:
            k = min(k + 2, n)
            start = int(self.rng.integers(n - k + 1))
            return self.reinsert(order, start, start + k, np.arange(start, start + k))
        place = np.full(self.n, -1)
        place[order] = np.arange(n)
        at = int(self.rng.integers(n))
        near = place[self.near[order[at]]]
        near = near[(near >= 0) & (np.abs(near - at) <= effort.reach // 2)][: k + 5]
        taken = np.sort(self.rng.choice(near, min(k, len(near)), replace=False))
        return self.reinsert(order, max(0, int(taken[0]) - 2), min(n, int(taken[-1]) + 3), taken)

    def avoiding(self, order: tuple[int, ...]) -> Order | None:
        """An order without forbidden neighbours, of the first regions of `order` where possible; None if none turns up.

        Depth-first; a region that few may follow comes before others.
        """
        rank = {a: i for i, a in enumerate(order)}
        strict = {a: int(self.never_next[:, a].sum() + self.never_next[a].sum()) for a in order}
        start: list[int] = [self.last_done] if self.last_done >= 0 else []
        stack = [start]
        for _ in range(AVOIDING):
            if not stack:
                return None
            chain = stack.pop()
            waiting = [a for a in order if a not in chain]
            if not waiting:
                return np.array(chain[len(start) :], np.int64)
            ready = [a for a in waiting if not self.before[waiting, a].any() and not (chain and self.never_next[chain[-1], a])]
            stack.extend([*chain, a] for a in sorted(ready, key=lambda a: (strict[a], -rank[a])))
        return None

    def shake(self, order: Order) -> Order:
        """A block moved elsewhere, perhaps turned round; the order itself where that is not allowed."""
        n = len(order)
        i, j = np.sort(self.rng.choice(n + 1, 2, replace=False))
        j = min(j, i + max(1, n // 3))
        block, rest = order[i:j], np.concatenate([order[:i], order[j:]])
        block = block[::-1] if self.rng.random() < 0.5 else block
        at = int(self.rng.integers(len(rest) + 1))
        moved = np.concatenate([rest[:at], block, rest[at:]])
        return moved if self.allowed(moved) else order


def best_found(
    problem: SequencingProblem,
    w: Array,
    resolved: Resolved | None = None,
    seed: int = 0,
    effort: Effort | None = None,
    should_stop: Callable[[], bool] = lambda: False,
    report: Report = lambda _share, _cost: None,
) -> tuple[int, ...]:
    """The cheapest order found; regions finished before come first in it, skipped ones are left out.

    Args:
        problem: The tool and its features.
        w: Weights, shape (n + m,).
        resolved: Constraints.
        seed: Other seeds may find other orders; the same seed always finds the same.
        effort: How long to search; by default as suits the features.
        should_stop: Asked after every move; the best order so far is returned when it says so.
        report: Told after every gain and at the end.

    Raises:
        ContradictoryConstraints: No order without forbidden neighbours turned up; names those that stand in the way.
    """
    r = resolved or resolve(None, problem.n)
    search = Search(problem, problem.check_weights(w), r, seed)
    effort = effort or (NORMAL if search.model is not None else SLOW)
    if not len(search.free):
        return r.done
    best, stopped = _descents(search, _starts(search, problem, w, r, effort), effort, should_stop, report)
    lowest = best[0]
    for turn, begin in enumerate(() if stopped else best):
        lowest = min(lowest, _wander(search, begin, effort, (turn, len(best)), lowest[0], should_stop, report))
    if search.chained and not stopped:
        cost, order = search.relocated(lowest[0], np.array(lowest[1], np.int64))
        lowest = (cost, tuple(order.tolist()))
    if search.broken(np.array(lowest[1])):
        lowest = _mended(search, lowest[1], effort)
    report(1.0, lowest[0])
    return r.done + lowest[1]


def _descents(
    search: Search, starts: Iterator[Order], effort: Effort, should_stop: Callable[[], bool], report: Report
) -> tuple[list[Found], bool]:
    """The best of what the starts descend to, cheapest first, and whether to stop there."""
    found: list[Found] = []
    for start in starts:
        cost, order = search.descend(start, effort.stretch)
        if not found or cost < min(found)[0]:
            report(0.0, cost)
        found.append((cost, tuple(order.tolist())))
        if should_stop():
            return sorted(set(found)), True
    return sorted(set(found))[: effort.kept], False


def _mended(search: Search, order: tuple[int, ...], effort: Effort) -> Found:
    """An order near this one that has no forbidden neighbours, made cheaper by stretches."""
    start = search.avoiding(order)
    if start is None:
        chain = (*([search.last_done] if search.last_done >= 0 else []), *order)
        letters = region_letters(search.n)
        pairs = [f"{letters[b]} never directly after {letters[a]}" for a, b in itertools.pairwise(chain) if search.never_next[a, b]]
        raise ContradictoryConstraints(f"No order was found that keeps {listed(pairs)}. Take one of these away.")
    cost, mended = search.descend(start, effort.stretch)
    return cost, tuple(mended.tolist())


def between_costs(problem: SequencingProblem, w: Array) -> tuple[Array, Array]:
    """What a region costs more after another, (N, N) [before, after], and as the first, (N,)."""
    between, start = np.zeros((problem.n, problem.n)), np.zeros(problem.n)
    last = getattr(problem, "last", ())
    for weight, feature in zip(w[len(w) - len(last) :], last, strict=True):
        between, start = between + weight * feature.between, start + weight * feature.start
    return between, start


def _starts(search: Search, problem: SequencingProblem, w: Array, r: Resolved, effort: Effort) -> Iterator[Order]:
    for width in effort.beams:
        yield np.array(beam(problem, search.w, width, r), np.int64)
    if effort.sweeps:
        yield from search.sweeps()


def _wander(
    search: Search,
    begin: Found,
    effort: Effort,
    turn: tuple[int, int],
    lowest: float,
    should_stop: Callable[[], bool],
    report: Report,
) -> Found:
    """Moves from one start, the best order met."""
    cost, order = begin[0], np.array(begin[1], np.int64)
    best, best_order, idle = cost, order, 0
    moves = effort.moves // turn[1]
    for i in range(moves):
        if should_stop():
            break
        trial = search.move(order, effort)
        value = cost if np.array_equal(trial, order) else search.cost(trial)
        idle = 0 if value < cost - IMPROVES * abs(cost) else idle + 1
        if value <= cost + IMPROVES * abs(cost):
            cost, order = value, trial
        if cost < best - IMPROVES * abs(best):
            best, best_order = cost, order
            if best < lowest:
                report((turn[0] + i / moves) / turn[1], best)
        if idle > effort.patience:
            idle = 0
            order = search.shake(best_order if search.rng.random() < 0.7 else order)
            cost = search.cost(order)
    return best, tuple(best_order.tolist())
