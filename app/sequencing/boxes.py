"""The gaps of a set and of what it leaves, bounded for every size of the set at once.

A set lies within its bounding box and the rest within its own; a region outside the box around the rest must be in the set,
one outside the set's box must not. For each pair of boxes the cheapest set of each size follows by sorting.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from app.geometry.tool import Array
from app.sequencing.relaxations import cheapest_sets
from app.sequencing.structure import Declaration, Gap

GROUPS = (26, 18, 11, 8)  # different coordinates per side of the box; more are joined to this many
MOST_BOXES = 3100  # the first of GROUPS that keeps below this is taken
SAME = 1e-6  # of the tool's extent: coordinates this close are one


@dataclass(frozen=True)
class Boxes:
    """Pairs of boxes, around what is finished and around the rest."""

    columns: tuple[int, ...]  # features that are covered
    weights: Array  # (2,) of the gap inside and of the gap left
    area: Array  # (F,) of the free regions
    fixed: NDArray[np.int64]  # (Q, F) 1 must be finished, -1 must not, 0 free
    areas: Array  # (Q, 2) of the boxes
    total: float  # area of all regions
    done_area: float
    small: Array  # (3, F) exact cost with none, with one and with all but one of the free regions finished

    def cheapest(self, price: Array) -> tuple[float, Array]:
        """Least cost over all sizes 0 .. F - 1 when a member pays `price` (F,), and in how many of the sets each is."""
        count = len(price)
        low, chosen = np.full(count + 1, np.inf), np.zeros((count + 1, count), np.bool_)
        base = np.array([self.done_area, 0.0])
        cheapest_sets(price, self.area, self.fixed, self.areas, self.weights, self.total, base, low, chosen)
        for size, cost in ((count - 1, self.small[2] + price.sum() - price), (1, self.small[1] + price), (0, self.small[0])):
            a = int(np.argmin(cost))
            if size < count:
                low[size] = cost[a]
                chosen[size] = {0: np.zeros(count, np.bool_), 1: np.arange(count) == a}.get(size, np.arange(count) != a)
        return float(low[:count].sum()), chosen[:count].sum(axis=0).astype(np.float64)


def boxes_of(columns: tuple[Declaration, ...], w: Array, free: NDArray[np.int64], past: NDArray[np.int64], n: int) -> Boxes | None:
    """The pairs for the gap columns that cost anything; None without any."""
    gaps = {i: d for i, d in enumerate(columns) if isinstance(d, Gap) and w[i] > 0 and d.shape != "hull"}
    if not gaps:
        return None
    one = next(iter(gaps.values()))
    gaps = {i: d for i, d in gaps.items() if d.shape == one.shape and np.array_equal(d.low, one.low) and np.array_equal(d.area, one.area)}
    weights = np.array([sum(w[i] for i, d in gaps.items() if d.of == of) for of in ("done", "left")])
    skipped = np.setdiff1d(np.arange(n), np.concatenate([free, past]))
    within, areas = next((b for b in (_boxes(one, most) for most in GROUPS[:-1]) if len(b[1]) <= MOST_BOXES), None) or _boxes(
        one, GROUPS[-1]
    )
    whole = (np.ones((1, n), np.bool_), np.zeros(1))  # no box at all: costs nothing
    inside, inside_area = (within[w_], areas[w_]) if weights[0] > 0 and (w_ := within[:, past].all(axis=1)).any() else whole
    rest, rest_area = (within[w_], areas[w_]) if weights[1] > 0 and (w_ := within[:, skipped].all(axis=1)).any() else whole
    inside, rest = inside[:, free], rest[:, free]
    covered = (~inside).astype(np.float32) @ (~rest).astype(np.float32).T == 0
    first, second = np.nonzero(covered)
    fixed = np.where(~inside[first], -1, np.where(~rest[second], 1, 0))
    pairs = np.stack([inside_area[first], rest_area[second]], axis=1)
    small = np.stack([_exact(gaps, w, sets, past, n) for sets in _small_sets(free, past, n)])
    return Boxes(tuple(gaps), weights, one.area[free].copy(), fixed, pairs, float(one.area.sum()), float(one.area[past].sum()), small)


def _small_sets(free: NDArray[np.int64], past: NDArray[np.int64], n: int) -> list[NDArray[np.bool_]]:
    """(F, N) sets: none, one, all but one of the free regions on top of what was finished before."""
    base = np.zeros((len(free), n), np.bool_)
    base[:, past] = True
    single, but_one = base.copy(), base.copy()
    single[np.arange(len(free)), free] = True
    but_one[:, free] = True
    but_one[np.arange(len(free)), free] = False
    return [base, single, but_one]


def _exact(gaps: dict[int, Gap], w: Array, sets: NDArray[np.bool_], past: NDArray[np.int64], n: int) -> Array:
    total = np.zeros(len(sets))
    nothing = ~sets.any(axis=1)
    for i, d in gaps.items():
        value = d.of_sets(sets)
        if d.empty is not None:
            value = np.where(nothing, d.empty.min(), value)
        total += w[i] * value
    return total


def _boxes(d: Gap, most: int) -> tuple[NDArray[np.bool_], Array]:
    """Which regions lie in each box, (Q, N), and a lower bound on the area of a box of regions that has these sides, (Q,)."""
    sides, spans = [_sides(d.low[:, k], d.high[:, k], most) for k in range(2)], []
    for low, high in sides:
        keep = low[:, None, 0] <= high[None, :, 0]
        i, j = np.nonzero(keep)
        spans.append(np.concatenate([low[i], high[j]], axis=1))  # outer low, inner low, outer high, inner high
    x, y = (s.ravel() for s in np.meshgrid(np.arange(len(spans[0])), np.arange(len(spans[1])), indexing="ij"))
    one, two = spans[0][x], spans[1][y]
    within = np.ones((len(one), len(d.area)), np.bool_)
    for k, s in enumerate((one, two)):
        within &= (d.low[:, k] >= s[:, :1]) & (d.high[:, k] <= s[:, 2:3])
    reached = within.any(axis=1)
    for k, s in enumerate((one, two)):  # some member must reach each side, or no set has this box
        reached &= (within & (d.low[:, k] <= s[:, 1:2])).any(axis=1) & (within & (d.high[:, k] >= s[:, 3:4])).any(axis=1)
    one, two, within = one[reached], two[reached], within[reached]
    return within, _areas(d, one, two)


def _areas(d: Gap, one: Array, two: Array) -> Array:
    """Areas of the inner boxes, 0 where a side is empty."""
    extents = [np.maximum(s[:, 3] - s[:, 1], 0.0) for s in (one, two)]
    if d.shape == "plain":
        return extents[0] * extents[1]
    share = np.ones((len(one), len(d.area)))
    for k, s in enumerate((one, two)):
        common = np.minimum(d.high[:, k], s[:, 3:4]) - np.maximum(d.low[:, k], s[:, 1:2])
        extent = d.high[:, k] - d.low[:, k]
        share *= np.where(extent > 0, np.maximum(common, 0.0) / np.where(extent > 0, extent, 1.0), common >= 0)
    return share @ d.area


def _sides(low: Array, high: Array, most: int) -> tuple[Array, Array]:
    """Groups of coordinates of either side, rows of (outer, inner)."""
    near = SAME * max(float(high.max() - low.min()), 1e-300)
    lows = [(g.min(), g.max()) for g in _groups(np.unique(low), near, most)]
    highs = [(g.max(), g.min()) for g in _groups(np.unique(high), near, most)]
    return np.array(lows), np.array(highs)


def _groups(values: Array, near: float, most: int) -> list[Array]:
    groups = np.split(values, np.flatnonzero(np.diff(values) > near) + 1)
    if len(groups) <= most:
        return groups
    return [np.concatenate([groups[i] for i in part]) for part in np.array_split(np.arange(len(groups)), most)]
