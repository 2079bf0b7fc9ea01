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

GROUPS = (40, 26, 18, 11, 8)  # different coordinates per side of the box; more are joined to this many
MOST_BOXES = 8000  # the first of GROUPS that keeps below this is taken
AT_ONCE = 500  # boxes paired with all others at a time
SAME = 1e-6  # of the tool's extent: coordinates this close are one


@dataclass(frozen=True)
class Boxes:
    """Pairs of boxes, around what is finished and around the rest."""

    columns: tuple[int, ...]  # features that are covered
    area: Array  # (F,) of the free regions
    fixed: NDArray[np.int8]  # (Q, F) 1 must be finished, -1 must not, 0 free
    boxes: Array  # (Q, 4) how many must be, how many are free, the gap cost of those that must, what an area adds to it
    small: Array  # (F,) exact cost of the sets of one free region
    last: NDArray[np.int64]  # (F,) pair that each size chose before, a hint

    def cheapest(self, price: Array) -> tuple[float, Array]:
        """Least cost over the sizes 1 .. F - 2 when a member of the set of a size pays `price` (F, F), and the sets (F, F)."""
        count = len(price)
        low, chosen = np.full(count, np.inf), np.zeros((count, count), np.bool_)
        cheapest_sets(price, self.area, self.fixed, self.boxes, self.last, low, chosen)
        if count > 2:
            a = int(np.argmin(self.small + price[1]))
            low[1], chosen[1, a] = self.small[a] + price[1, a], True
        return float(low[1 : count - 1].sum()), chosen.astype(np.float64)


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
    first, second = _covering(inside, rest)
    fixed = np.where(~inside[first], -1, np.where(~rest[second], 1, 0)).astype(np.int8)
    boxes = _costs(
        fixed, one.area[free], weights, inside_area[first], rest_area[second], float(one.area.sum()), float(one.area[past].sum())
    )
    single = np.zeros((len(free), n), np.bool_)
    single[:, past] = True
    single[np.arange(len(free)), free] = True
    small = _exact(gaps, w, single)
    return Boxes(tuple(gaps), one.area[free].copy(), fixed, boxes, small, np.zeros(len(free), np.int64))


def _covering(inside: NDArray[np.bool_], rest: NDArray[np.bool_]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Pairs of boxes that hold every region between them."""
    out, beyond = (~inside).astype(np.float32), (~rest).astype(np.float32).T
    found = [np.nonzero(out[i : i + AT_ONCE] @ beyond == 0) for i in range(0, len(out), AT_ONCE)]
    return np.concatenate([a + i * AT_ONCE for i, (a, _) in enumerate(found)]), np.concatenate([b for _, b in found])


def _costs(fixed: NDArray[np.int8], area: Array, weights: Array, inside: Array, rest: Array, total: float, done: float) -> Array:
    """How many must be in the set, how many are free, the gap cost of those that must, and what each area adds, (Q, 4)."""
    held = done + (fixed == 1) @ area
    one, two = (np.divide(w, a, out=np.zeros_like(a), where=a > 0) for w, a in zip(weights, (inside, rest), strict=True))
    cost = np.where(inside > 0, weights[0], 0.0) - one * held + np.where(rest > 0, weights[1], 0.0) - two * (total - held)
    return np.stack([(fixed == 1).sum(axis=1), (fixed == 0).sum(axis=1), cost, two - one], axis=1)


def _exact(gaps: dict[int, Gap], w: Array, sets: NDArray[np.bool_]) -> Array:
    return sum((w[i] * d.of_sets(sets) for i, d in gaps.items()), np.zeros(len(sets)))


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
