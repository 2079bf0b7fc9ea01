"""The cost of a transition as the kernels read it, composed from what the features declare (`structure`).

Every sum of declared features, so the cost itself and every factor of an interaction, has one shape:

    F(S, a) = start[a] + sum over b in S of change[a, b]       borders, angles, static parts
            + touch[a, first test that S passes]               proximity
            + sum over t of slope[t] * |own[t, a] - mean_S t|  curvature, height
            + rank[|S|, a]
            + state(S)                                         gaps, open borders, and what is linear in the means

A slope that differs upwards and downwards is an absolute value plus a part linear in the mean, which does not depend on the
region and so goes to the state. The cost is F_0 plus weighted products of other F.

Only regions still to be ordered (`free`) are numbered here; finished and skipped ones go into the constants.
"""

# pyright: reportIncompatibleMethodOverride=false
# Named tuples with a field `count`, because that is what compiled code takes.

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from app.geometry.compiled import kernel
from app.geometry.tool import Array
from app.sequencing.gaps import box_gap, hull_gaps
from app.sequencing.structure import Between, Declaration, FirstTouch, Gap, MeanStep, Pairwise, Rank, Undeclared

Ints = NDArray[np.int64]
NO_TEST = 3  # level of touch when no test is passed
WITHIN, PLAIN, HULL, BETWEEN = range(4)


class SetValues(NamedTuple):
    """G values that depend on the set only; over all M regions of the tool."""

    kind: Ints  # (G,) WITHIN, PLAIN, HULL or BETWEEN
    left: NDArray[np.bool_]  # (G,) of the unfinished regions
    low: Array  # (G, M, 2)
    high: Array  # (G, M, 2)
    area: Array  # (G, M)
    matrix: Array  # (G, M, M)
    free: Ints  # (N,) the regions that bits stand for
    done: NDArray[np.bool_]  # (M,) finished before


class Shape(NamedTuple):
    """What the declared columns of a tool are made of, whatever the weights; n columns, N free regions."""

    start: Array  # (n, N)
    change: Array  # (n, N, N)
    tests: NDArray[np.bool_]  # (U, 3, N, N) each cascade's tests [a, b], padded with tests that nothing passes
    reached: Ints  # (U, N) first test that the regions finished before pass
    touch: Array  # (n, U, 4) value by the first test passed
    averaged: Array  # (Q, N) what means are taken of
    total: Array  # (Q,) sum over the regions finished before
    count: int  # of the regions finished before
    own: Array  # (T, N) what is compared with a mean
    of: Ints  # (T,) which mean
    slope: Array  # (n, T)
    drift: Array  # (n, Q) times the mean
    rank: Array  # (n, N, N) [column, number finished, a]
    state: Array  # (n, G) coefficients of the values of a set
    values: SetValues


class Form(NamedTuple):
    """The cost under given weights: first index f, F_0 and the factors of the products."""

    start: Array  # (F, N)
    change: Array  # (F, N, N)
    tests: NDArray[np.bool_]  # (U, 3, N, N)
    reached: Ints  # (U, N)
    touch: Array  # (F, U, 4)
    averaged: Array  # (Q, N)
    total: Array  # (Q,)
    count: int
    own: Array  # (T, N)
    of: Ints  # (T,)
    slope: Array  # (F, T)
    drift: Array  # (F, Q)
    rank: Array  # (F, N, N)
    state: Array  # (F, G)
    values: SetValues
    pair: Ints  # (P, 2) factors of each product
    weight: Array  # (P,)
    before: Ints  # (N,) bit mask of the regions that must be finished before a
    first: Array  # (N,) cost of each region where nothing is finished
    extra: Array  # (N, 2^N) what undeclared columns add; (0, 0) without


@dataclass(frozen=True)
class Declared:
    """The shape of all columns, and which of them have none."""

    shape: Shape
    undeclared: tuple[int, ...]  # columns that are zero in the shape


def compose(declarations: tuple[Declaration, ...], n: int, free: tuple[int, ...], done: tuple[int, ...]) -> Declared:
    """The common shape of all columns, for the orders of the free regions after the done ones."""
    c = len(declarations)
    start, change, rank = np.zeros((c, n)), np.zeros((c, n, n)), np.zeros((c, n, n))
    slope, drift, state, touch = np.zeros((c, c)), np.zeros((c, c)), np.zeros((c, c)), np.zeros((c, c, 4))
    means, steps, cascades, sets = _Distinct(), _Distinct(), _Distinct(), _Distinct()
    for i, d in enumerate(declarations):
        match d:
            case Pairwise():
                start[i], change[i] = d.start, d.change
            case MeanStep():
                q, lean = means.index(d.averaged), (d.rise - d.fall) / 2
                t = steps.index(np.concatenate([[q], d.own]))
                start[i], drift[i, q], slope[i, t] = d.static + lean * d.own, -lean, (d.rise + d.fall) / 2
            case FirstTouch():
                touch[i, cascades.index(_padded(d, n))] = [*(v for _, v in d.tests), *[d.otherwise] * (4 - len(d.tests))]
            case Rank():
                rank[i] = d.table
            case Gap() | Between():
                state[i, sets.index(d)] = 1.0
            case Undeclared():
                pass
    keep, past = np.array(free, np.int64), np.array(done, np.int64)
    tests = np.array(cascades.kept, np.bool_).reshape(-1, 3, n, n)
    averaged = np.array(means.kept, np.float64).reshape(-1, n)
    own = np.array(steps.kept, np.float64).reshape(-1, n + 1)
    passed = np.concatenate([tests[..., past].any(axis=-1), np.ones((len(tests), 1, n), np.bool_)], axis=1)
    shape = Shape(
        start=np.ascontiguousarray((start + change[:, :, past].sum(axis=2))[:, keep]),
        change=_square(change, keep),
        tests=_square(tests, keep),
        reached=passed.argmax(axis=1)[:, keep],
        touch=touch[:, : len(tests)].copy(),
        averaged=averaged[:, keep].copy(),
        total=averaged[:, past].sum(axis=1),
        count=len(done),
        own=own[:, 1:][:, keep].copy(),
        of=own[:, 0].astype(np.int64),
        slope=slope[:, : len(own)].copy(),
        drift=drift[:, : len(averaged)].copy(),
        rank=rank[:, len(done) : len(done) + len(keep)][:, :, keep].copy(),
        state=state[:, : len(sets.kept)].copy(),
        values=_set_values(sets.kept, n, keep, past),
    )
    return Declared(shape, tuple(i for i, d in enumerate(declarations) if isinstance(d, Undeclared)))


def _square(values: NDArray[Any], keep: Ints) -> NDArray[Any]:
    return np.ascontiguousarray(values[..., keep, :][..., keep])


def _padded(d: FirstTouch, n: int) -> NDArray[np.bool_]:
    tests = np.zeros((3, n, n), np.bool_)
    for k, (touching, _) in enumerate(d.tests):
        tests[k] = touching
    return tests


def _set_values(sets: list[Gap | Between], n: int, free: Ints, past: Ints) -> SetValues:
    g, finished = len(sets), np.zeros(n, np.bool_)
    finished[past] = True
    low, high, area, matrix = np.zeros((g, n, 2)), np.zeros((g, n, 2)), np.zeros((g, n)), np.zeros((g, n, n))
    kind, left = np.zeros(g, np.int64), np.zeros(g, np.bool_)
    for i, d in enumerate(sets):
        if isinstance(d, Between):
            kind[i], matrix[i] = BETWEEN, d.matrix
        else:
            kind[i], left[i] = {"within": WITHIN, "plain": PLAIN, "hull": HULL}[d.shape], d.of == "left"
            low[i], high[i], area[i] = d.low, d.high, d.area
    return SetValues(kind, left, low, high, area, matrix, free, finished)


class _Distinct:
    """Numbers values; equal ones get the same number."""

    def __init__(self) -> None:
        self.kept: list[Any] = []

    def index(self, value: Any) -> int:
        for i, known in enumerate(self.kept):
            if _same(known, value):
                return i
        self.kept.append(value)
        return len(self.kept) - 1


def _same(a: Any, b: Any) -> bool:
    if isinstance(a, np.ndarray) and isinstance(b, np.ndarray):
        return np.array_equal(a, b)
    if isinstance(a, Gap) and isinstance(b, Gap):
        return (a.of, a.shape) == (b.of, b.shape) and all(np.array_equal(getattr(a, k), getattr(b, k)) for k in ("low", "high", "area"))
    return a is b


@kernel(nogil=True)
def weigh(shape: Shape, mix: Array, pair: Ints, weight: Array, before: Ints, first: Array, extra: Array) -> Form:
    """The form whose F are the mixtures `mix` (F, n) of the columns."""
    f, c = mix.shape
    n, g = shape.start.shape[1], shape.state.shape[1]
    start, change, rank = np.zeros((f, n)), np.zeros((f, n, n)), np.zeros((f, n, n))
    touch, state = np.zeros((f, shape.touch.shape[1], 4)), np.zeros((f, g))
    slope, drift = np.zeros((f, shape.slope.shape[1])), np.zeros((f, shape.drift.shape[1]))
    for i in range(f):
        for j in range(c):
            if mix[i, j] != 0:
                start[i] += mix[i, j] * shape.start[j]
                _add_multiple(change[i], mix[i, j], shape.change[j])
                _add_multiple(rank[i], mix[i, j], shape.rank[j])
                _add_multiple(touch[i], mix[i, j], shape.touch[j])
                for t in range(slope.shape[1]):
                    slope[i, t] += mix[i, j] * shape.slope[j, t]
                for q in range(drift.shape[1]):
                    drift[i, q] += mix[i, j] * shape.drift[j, q]
                for k in range(g):
                    state[i, k] += mix[i, j] * shape.state[j, k]
    return Form(
        start, change, shape.tests, shape.reached, touch, shape.averaged, shape.total, shape.count, shape.own, shape.of, slope, drift,
        rank, state, shape.values, pair, weight, before, first, extra,
    )  # fmt: skip


@kernel(nogil=True, inline="always")
def _add_multiple(out: Array, factor: float, values: Array) -> None:
    for i in range(out.shape[0]):
        for j in range(out.shape[1]):
            out[i, j] += factor * values[i, j]


@kernel(nogil=True)
def set_value(v: SetValues, g: int, s: int) -> float:
    """Value g of the state s."""
    inside = v.done.copy()
    for i in range(len(v.free)):
        if s >> i & 1:
            inside[v.free[i]] = True
    if v.kind[g] == BETWEEN:
        total = 0.0
        for b in range(len(inside)):
            for c in range(len(inside)):
                if inside[b] and not inside[c]:
                    total += v.matrix[g, b, c]
        return total
    if v.left[g]:
        inside = ~inside
    if v.kind[g] == HULL:
        return hull_gaps(inside.reshape(1, -1), v.low[g], v.high[g], v.area[g])[0]
    return box_gap(inside, v.low[g], v.high[g], v.area[g], v.kind[g] == PLAIN)


@kernel(nogil=True)
def step_costs(form: Form, s: int, out: Array) -> None:
    """Cost of every region after the state s in float64, infinite where finished or not allowed yet.

    This is the definition of the cost in one place; the block kernel (`block`) computes the same for many states at once.
    """
    f, n = form.start.shape
    if s == 0 and form.count == 0:
        for a in range(n):
            out[a] = form.first[a] if form.before[a] == 0 else np.inf
        return
    count, members, scratch = 0, np.empty(n, np.int64), np.empty(len(form.total) + 2 * f)
    for b in range(n):
        if s >> b & 1:
            members[count] = b
            count += 1
    members, mean = members[:count], scratch[2 * f :]
    state, value = scratch[:f], scratch[f : 2 * f]
    _of_state(form, s, members, mean, state)
    for a in range(n):
        if s >> a & 1 or form.before[a] & ~s:
            out[a] = np.inf
            continue
        for i in range(f):
            value[i] = state[i] + _of_region(form, i, a, members, mean)
        for u in range(len(form.reached)):
            level = first_test(form, u, a, members)
            for i in range(f):
                value[i] += form.touch[i, u, level]
        out[a] = value[0]
        for p in range(len(form.weight)):
            out[a] += form.weight[p] * value[form.pair[p, 0]] * value[form.pair[p, 1]]
        if len(form.extra):
            out[a] += form.extra[a, s]


@kernel(nogil=True)
def _of_state(form: Form, s: int, members: Ints, mean: Array, state: Array) -> None:
    """Means over what is finished, and what every F adds whichever region comes next."""
    state[:] = 0.0
    for q in range(len(mean)):
        total = form.total[q]
        for b in members:
            total += form.averaged[q, b]
        mean[q] = total / (form.count + len(members))
        for i in range(len(state)):
            state[i] += form.drift[i, q] * mean[q]
    for g in range(form.state.shape[1]):
        needed = False
        for i in range(len(state)):
            needed = needed or form.state[i, g] != 0
        value = set_value(form.values, g, s) if needed else 0.0
        for i in range(len(state)):
            state[i] += form.state[i, g] * value


@kernel(nogil=True)
def _of_region(form: Form, i: int, a: int, members: Ints, mean: Array) -> float:
    """What F_i is for region a, without touch and what depends on the state only."""
    x = form.start[i, a] + form.rank[i, len(members), a]
    for b in members:
        x += form.change[i, a, b]
    for t in range(len(form.of)):
        x += form.slope[i, t] * abs(form.own[t, a] - mean[form.of[t]])
    return x


@kernel(nogil=True)
def first_test(form: Form, u: int, a: int, members: Ints) -> int:
    """The first test of cascade u that a finished region passes for region a."""
    for k in range(form.reached[u, a]):
        for b in members:
            if form.tests[u, k, a, b]:
                return k
    return form.reached[u, a]
