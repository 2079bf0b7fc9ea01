"""Costs of transitions for the search over large tools, compiled: many sets that differ in a few regions only.

The definitions are those of `features`; a test holds the two together. A set is a prefix of the sequence plus a subset of a
few chosen items, so everything about it follows from the same subset with one item less.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from app.geometry.compiled import kernel
from app.geometry.tool import Array
from app.sequencing.features import FEATURE_SETS, FeatureSet, base_name
from app.sequencing.problem import SequencingProblem

KINDS = ("clean", "authors-real", "authors-synthetic")
CLEAN, REAL, SYNTHETIC = range(3)


class Model(NamedTuple):
    """What the compiled cost of a transition reads; a tuple, because that is what the compiler takes."""

    kind: int  # index into KINDS
    n: int
    w: Array  # (n_phi,) weights of the features
    v: Array  # (m,) weights of the interactions
    factors: NDArray[np.int64]  # (m, 2, 2) the features whose sum is the factor; n_phi (always zero) where there is only one
    shared: Array  # (N, N)
    opposite: Array  # (N, N)
    turn: Array  # (N, N) taken from phi_9 by a finished b
    start: Array  # (N, 3) phi_1, phi_3 and phi_9 with nothing finished
    edge: NDArray[np.bool_]  # (N, N)
    corner: NDArray[np.bool_]  # (N, N)
    first: NDArray[np.int64]  # (N,)
    curvature: Array  # (N,)
    height: Array  # (N,)
    level: Array  # (N,) what the mean height is taken over
    inverse: Array  # (N,) static part of the authors' height step
    area: Array  # (N,)
    low: Array  # (N, 2)
    high: Array  # (N, 2)


def is_compiled(features: FeatureSet) -> bool:
    """Whether the compiled cost knows every column of the set."""
    return base_name(features.name) in KINDS and not features.plugins


def model_of(problem: SequencingProblem, w: Array) -> Model:
    """The compiled form of w . phi for a problem whose feature set `is_compiled`; columns switched off weigh nothing."""
    g, kind = problem.graph, KINDS.index(base_name(problem.features.name))
    columns = FEATURE_SETS[KINDS[kind]].columns
    place = [columns.index(c) for c in problem.features.columns]
    weights = np.zeros(len(columns))
    weights[place] = w[: len(place)]
    share = g.shared / np.maximum(g.shared.sum(axis=1, keepdims=True), 1e-30)
    pull = share * g.angle / (2 * np.pi)
    turn = (2 * pull, 2 * g.angle, g.angle)[kind]
    turn_start = (0.5 + pull.sum(axis=1), np.pi + g.angle.sum(axis=1), g.angle.sum(axis=1))[kind]
    flat = g.height == 0
    inverse = np.where(flat, 0.0, 1 / np.where(flat, 1.0, g.height))
    return Model(
        kind=kind,
        n=problem.n,
        w=weights,
        v=w[len(place) :].copy(),
        factors=_factors(problem, place, len(columns)),
        shared=_plain(g.shared),
        opposite=_plain(g.opposite),
        turn=_plain(turn),
        start=np.stack([g.shared.sum(axis=1), g.opposite.sum(axis=1), turn_start], axis=1),
        edge=np.array(g.neighbour, np.bool_, order="C"),
        corner=np.array(g.corner, np.bool_, order="C"),
        first=np.array(g.first, np.int64),
        curvature=_plain(g.curvature),
        height=_plain(g.height),
        level=_plain(g.height if kind == CLEAN else np.abs(g.height)),
        inverse=5 * inverse if kind == REAL else inverse,
        area=_plain(g.area),
        low=_plain(g.low),
        high=_plain(g.high),
    )


def _plain(values: Array) -> Array:
    return np.array(values, np.float64, order="C")


def _factors(problem: SequencingProblem, place: list[int], none: int) -> NDArray[np.int64]:
    factors = np.full((len(problem.interactions), 2, 2), none)
    for i, interaction in enumerate(problem.interactions):
        for j, key in enumerate((interaction.first, interaction.second)):
            columns = problem.features.factors[key]
            factors[i, j, : len(columns)] = [place[c] for c in columns]
    return factors


@kernel(nogil=True, error_model="numpy", inline="always")
def transition_cost(
    m: Model,
    a: int,
    count: int,
    curve: float,
    level: float,
    border: Array,
    edge: bool,
    corner: bool,
    first: bool,
    inside: float,
    left: float,
    phi: Array,
) -> float:
    """w . phi of region a after a set of `count` regions.

    `curve` and `level` are sums over the set, `border` (3,) what is taken of a's shared border, opposite border and turn;
    `edge`, `corner` and `first` say whether a neighbour of that sort is finished; `phi` is scratch, n_phi + 1 zeros.
    """
    started = count > 0
    size = max(count, 1)
    phi[0], phi[1] = m.start[a, 0] - border[0], border[0]
    phi[2], phi[3] = m.start[a, 1] - border[1], border[1]
    phi[5] = inside
    phi[6] = left if started else 0.0
    phi[8] = m.start[a, 2] - border[2]
    bend = m.curvature[a] - curve / size
    fall = level / size - m.height[a]
    if m.kind == CLEAN:
        phi[4] = 0.0 if (not started or edge) else (1 / 3 if corner else 1.0)
        phi[7] = abs(bend) / 2 if started else abs(m.curvature[a])
        phi[9] = max(0.0, -fall) if started else 0.0
        phi[10] = max(0.0, fall) if started else 0.0
    elif m.kind == REAL:
        listed = m.first[a] >= 0
        phi[4] = 0.0 if first else (5.0 if (corner and listed) else (0.0 if edge else 15.0))
        phi[7] = abs(bend) if started else m.curvature[a]
        phi[9] = m.inverse[a]
        if started:
            phi[9] += -99 * fall if fall < 0 else 21 * fall
    else:
        phi[4] = 0.0 if (edge or not started) else (5.0 if corner else 15.0)
        phi[6] = inside
        phi[7] = max(0.0, bend) if started else abs(m.curvature[a])
        phi[9] = ((-3 * fall if fall < 0 else fall) + m.inverse[a]) / 2 if started else abs(m.inverse[a])
    total = 0.0
    for i in range(len(m.w)):
        total += m.w[i] * phi[i]
    for j in range(len(m.v)):
        one = phi[m.factors[j, 0, 0]] + phi[m.factors[j, 0, 1]]
        total += m.v[j] * one * (phi[m.factors[j, 1, 0]] + phi[m.factors[j, 1, 1]])
    return total


@kernel(nogil=True, error_model="numpy")
def box_area(m: Model, lo0: float, lo1: float, hi0: float, hi1: float) -> float:
    """Area of a box as `kernels.box_gaps` takes it."""
    if m.kind == SYNTHETIC:
        return (hi0 - lo0) * (hi1 - lo1)
    total = 0.0
    for b in range(m.n):
        share = 1.0
        common, extent = min(m.high[b, 0], hi0) - max(m.low[b, 0], lo0), m.high[b, 0] - m.low[b, 0]
        if extent > 0:
            share *= max(common, 0.0) / extent
        elif common < 0:
            share = 0.0
        common, extent = min(m.high[b, 1], hi1) - max(m.low[b, 1], lo1), m.high[b, 1] - m.low[b, 1]
        if extent > 0:
            share *= max(common, 0.0) / extent
        elif common < 0:
            share = 0.0
        total += share * m.area[b]
    return total


@kernel(nogil=True, error_model="numpy", inline="always")
def grow_box(m: Model, boxes: Array, to: int, frm: int, b: int) -> None:
    """boxes[to] = boxes[frm] with region b added; rows are (low, low, high, high, box area, own area, members)."""
    lo0, lo1 = min(boxes[frm, 0], m.low[b, 0]), min(boxes[frm, 1], m.low[b, 1])
    hi0, hi1 = max(boxes[frm, 2], m.high[b, 0]), max(boxes[frm, 3], m.high[b, 1])
    if lo0 == boxes[frm, 0] and lo1 == boxes[frm, 1] and hi0 == boxes[frm, 2] and hi1 == boxes[frm, 3]:
        area = boxes[frm, 4]
    elif lo0 == boxes[to, 0] and lo1 == boxes[to, 1] and hi0 == boxes[to, 2] and hi1 == boxes[to, 3]:
        area = boxes[to, 4]  # what this row held before
    else:
        area = box_area(m, lo0, lo1, hi0, hi1)
    own, members = boxes[frm, 5] + m.area[b], boxes[frm, 6] + 1
    boxes[to, 0], boxes[to, 1], boxes[to, 2], boxes[to, 3] = lo0, lo1, hi0, hi1
    boxes[to, 4], boxes[to, 5], boxes[to, 6] = area, own, members


@kernel(nogil=True, error_model="numpy")
def no_box(boxes: Array, i: int) -> None:
    """Make row i the box of no region."""
    boxes[i, 0], boxes[i, 1], boxes[i, 2], boxes[i, 3] = np.inf, np.inf, -np.inf, -np.inf
    boxes[i, 4], boxes[i, 5], boxes[i, 6] = 0.0, 0.0, 0.0


@kernel(nogil=True, error_model="numpy", inline="always")
def gap_of(boxes: Array, i: int) -> float:
    """1 - area(S) / area(box of S), 0 for at most one region."""
    if boxes[i, 6] < 2 or not boxes[i, 4] > 0:
        return 0.0
    return 1 - boxes[i, 5] / boxes[i, 4]
