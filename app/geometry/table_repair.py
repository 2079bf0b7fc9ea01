"""Putting right what a region table's rows leave unclear, by what the other rows say; every repair is told."""

from collections.abc import Sequence
from itertools import combinations, pairwise

import numpy as np

from app.geometry.tool import Array

Sides = tuple[tuple[int, ...], ...]  # entries per side, clockwise from the back; -1 is the tool's outer edge
STEPS = ((-1, 0), (0, 1), (1, 0), (0, -1))  # (row, column) towards the neighbours on each side
MOST_ENTRIES = 24


def four_sides(a: int, groups: Sequence[Sequence[int]], others: Sequence[Sequence[Sequence[int]]]) -> Sides | None:
    """The four sides of region `a`, of which separators are missing or too many.

    Args:
        a: The region.
        groups: Its entries as its row separates them.
        others: The groups of every region, as listed.

    Returns:
        The way to set the separators that agrees best with where the neighbours list `a`; None without a single best one.
    """
    listed = [b for group in groups for b in group]
    here, at = set(), 0
    for group in groups[:-1]:
        at += len(group)
        here.add(at)
    here -= {0, len(listed)}
    if len(listed) < 4 or len(listed) > MOST_ENTRIES:
        return None
    options = [cuts for cuts in combinations(range(1, len(listed)), 3) if here <= set(cuts) or set(cuts) <= here]
    scored = sorted(((_agreement(a, sides, others), sides) for sides in (_cut(listed, cuts) for cuts in options)), reverse=True)
    if not scored or (len(scored) > 1 and scored[0][0] == scored[1][0]):
        return None
    return scored[0][1]


def _cut(listed: list[int], cuts: tuple[int, ...]) -> Sides:
    ends = (0, *cuts, len(listed))
    return tuple(tuple(listed[i:j]) for i, j in pairwise(ends))


def _agreement(a: int, sides: Sides, others: Sequence[Sequence[Sequence[int]]]) -> int:
    """How many neighbours list `a` on the opposite side, less the contradictions; two outer edges on one side contradict, too."""
    score = 0
    for i, side in enumerate(sides):
        score -= max(0, side.count(-1) - 1)
        for b in side:
            if b >= 0 and b != a and len(others[b]) == 4:
                where = {j for j, group in enumerate(others[b]) if a in group}
                score += (((i + 2) % 4) in where) - bool(where and ((i + 2) % 4) not in where)
    return score


def places_by_neighbours(borders: Sequence[Sides]) -> Array:
    """Row and column of each region (N, 2), worked out from who lies on which side of whom; pieces apart stand side by side."""
    place: dict[int, tuple[int, int]] = {}
    for start in range(len(borders)):
        if start in place:
            continue
        first = max((column for _, column in place.values()), default=-2) + 2
        place[start] = (0, first)
        queue = [start]
        for a in queue:
            for side, (down, right) in zip(borders[a], STEPS, strict=True):
                for b in side:
                    if b >= 0 and b not in place:
                        place[b] = (place[a][0] + down, place[a][1] + right)
                        queue.append(b)
    rows = np.array([place[a] for a in range(len(borders))], float)
    return rows - rows.min(axis=0)
