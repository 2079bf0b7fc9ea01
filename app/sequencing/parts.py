"""The cost of an order, split into the relaxed problems that `bounds` adds up."""

from dataclasses import dataclass

import numpy as np

from app.geometry.tool import Array
from app.sequencing.boxes import Boxes, boxes_of
from app.sequencing.constraints import Resolved
from app.sequencing.features import declare
from app.sequencing.intervals import interval_of, product, sum_of, weighted
from app.sequencing.large import between_costs
from app.sequencing.pairs import Pairs, pairs_of, proximity
from app.sequencing.problem import SequencingProblem
from app.sequencing.relaxations import Ints
from app.sequencing.structure import Declaration, FirstTouch, MeanStep, Pairwise
from app.sequencing.walks import TRACKED, Product, Steps, Tracked


@dataclass(frozen=True)
class Chain:
    """What a free region costs directly after another."""

    between: Array  # (F, F) [before, after]; inf where it must not follow
    start: Array  # (F,) as the first


@dataclass(frozen=True)
class Parts:
    """The cost of an order of F free regions, split."""

    steps: Steps
    pairs: Pairs
    boxes: Boxes | None
    chain: Chain | None
    first: Ints  # (F,) first position of a region
    last: Ints  # and its last


def split(problem: SequencingProblem, w: Array, resolved: Resolved) -> Parts:
    """The parts of w . phi over the orders of the free regions."""
    free, past = np.array(resolved.free, np.int64), np.array(resolved.done, np.int64)
    columns, width = declare(problem.graph, problem.features), len(problem.features.columns)
    known = [interval_of(d, free, past, problem.n) for d in columns]
    boxes = boxes_of(columns, w, free, past, problem.n)
    tracked, products, left = _tracked(problem, columns, w, free, past)
    touch = next((i for i, d in enumerate(columns) if isinstance(d, FirstTouch) and w[i] != 0), -1)
    elsewhere = {touch, *(boxes.columns if boxes is not None else ()), *(i for t in tracked for i in t.steps)}
    fixed, change = np.zeros((len(free), len(free))), np.zeros((len(free), len(free)))
    for i, d in enumerate(columns):
        if isinstance(d, Pairwise):
            change += w[i] * d.change[np.ix_(free, free)]
            fixed += w[i] * _start(d, free, past)
        elif i not in elsewhere:
            fixed += weighted(w[i], known[i])
    for p in left:
        fixed += weighted(p.weight, product(sum_of([known[i] for i in p.one]), sum_of([known[i] for i in p.two])))
    local = next((p for p in products if p == _local(p, columns, tracked[0])), None)
    linear = () if local is None else tuple(columns[i] for i in local.two)
    start = sum((_start(d, free, past) for d in linear), np.zeros(len(free)))
    pull = sum((d.change[np.ix_(free, free)] for d in linear if isinstance(d, Pairwise)), np.zeros_like(change))
    before = resolved.before[np.ix_(free, free)]
    near = columns[touch] if touch >= 0 else None
    tests = proximity(near if isinstance(near, FirstTouch) else None, float(w[touch]), free, past)
    first, last = before.sum(axis=0), len(free) - 1 - before.sum(axis=1)
    _fix_ends(problem, w[: width + len(problem.interactions)], free, past, change, fixed)
    position = np.arange(len(free))[:, None]
    fixed[(position < first) | (position > last)] = np.inf
    others = tuple(p for p in products if p is not local)
    steps = Steps(fixed, len(past), tracked, known, others, local, start, pull)
    return Parts(steps, pairs_of(change, pull, tests, before), boxes, _chain(problem, w, resolved), first, last)


def _start(d: Declaration, free: Ints, past: Ints) -> Array:
    """A linear column with none of the free regions finished."""
    assert isinstance(d, Pairwise)
    return d.start[free] + d.change[np.ix_(free, past)].sum(axis=1)


def _fix_ends(problem: SequencingProblem, w: Array, free: Ints, past: Ints, change: Array, fixed: Array) -> None:
    """The first and the last step are known exactly."""
    first = np.zeros((1, problem.n), np.bool_)
    first[:, past] = True
    last = np.repeat(first, len(free), axis=0)
    last[:, free] = ~np.eye(len(free), dtype=np.bool_)
    fixed[0] = problem.values(first)[0, free] @ w
    fixed[-1] = problem.values(last)[np.arange(len(free)), free] @ w - change.sum(axis=1)


def _tracked(
    problem: SequencingProblem, columns: tuple[Declaration, ...], w: Array, free: Ints, past: Ints
) -> tuple[tuple[Tracked, Tracked], list[Product], list[Product]]:
    """The two means that count most, the products that they help with, and the other products."""
    means: list[Tracked] = []
    for i, d in enumerate(columns):
        if isinstance(d, MeanStep):
            t = next((t for t in means if np.array_equal(t.averaged, d.averaged[free])), None)
            if t is None:
                t = Tracked(d.averaged[free], float(d.averaged[past].sum()), {})
                means.append(t)
            t.steps[i] = (float(w[i]), MeanStep(d.averaged[free], d.own[free], d.rise, d.fall, d.static[free]))
    means += [Tracked(np.zeros(len(free)), 0.0, {}) for _ in range(TRACKED)]
    means = sorted(means, key=lambda t: -t.importance)[:TRACKED]
    products = [p for p in _products(problem, w) if p.weight]
    if not any(_local(p, columns, means[0]) for p in products) and any(_local(p, columns, means[1]) for p in products):
        means.reverse()
    products = [_local(p, columns, means[0]) or p for p in products]
    helped = [p for p in products if _is_helped(p, means)]
    return (means[0], means[1]), helped, [p for p in products if p not in helped]


def _products(problem: SequencingProblem, w: Array) -> list[Product]:
    factors, width = problem.features.factors, len(problem.features.columns)
    return [Product(float(w[width + j]), factors[i.first], factors[i.second]) for j, i in enumerate(problem.interactions)]


def _local(p: Product, columns: tuple[Declaration, ...], mean: Tracked) -> Product | None:
    """A tracked mean's columns times columns that are linear in what is finished, in this order; None for other products."""
    for one, two in ((p.one, p.two), (p.two, p.one)):
        if set(one) <= set(mean.steps) and all(isinstance(columns[i], Pairwise) for i in two):
            return Product(p.weight, one, two)
    return None


def _is_helped(p: Product, means: list[Tracked]) -> bool:
    """Whether each factor is of one mean or of none, and some mean takes part."""
    kinds = [_kind(side, means) for side in (p.one, p.two)]
    return -1 not in kinds and kinds != [TRACKED, TRACKED]


def _kind(side: tuple[int, ...], means: list[Tracked]) -> int:
    """Which mean all columns of a factor belong to, TRACKED for none, -1 for a mixture."""
    of = {next((t for t, m in enumerate(means) if i in m.steps), TRACKED) for i in side}
    return of.pop() if len(of) == 1 else -1


def _chain(problem: SequencingProblem, w: Array, resolved: Resolved) -> Chain | None:
    between, first = between_costs(problem, w)
    if not (between.any() or first.any() or resolved.never_next.any()):
        return None
    between = np.where(resolved.never_next, np.inf, between)
    free = np.array(resolved.free, np.int64)
    after = between[np.ix_(free, free)].copy()
    np.fill_diagonal(after, np.inf)
    return Chain(after, (between[resolved.done[-1], free] if resolved.done else first[free]).copy())
