"""Baselines without learning: copy the order of the most similar tool, or draw weights by chance."""

import numpy as np

from app.geometry.tool import RegionGraph
from app.learning.baselines.learner import Learned, Sequence, by_weights
from app.learning.performance_state import LearningDemonstration
from app.learning.qp import Array
from app.sequencing.problem import SequencingProblem

SAME_ROW = 0.5  # of the smaller region's height: centres closer than this are in one row

Rows = list[list[int]]


def copy_nearest(demonstrations: list[LearningDemonstration], generator: np.random.Generator) -> Learned:
    """The row pattern of the nearest demonstrated tool with as many regions in each row; without one, each row middle first."""
    del generator
    known = [(rows_of(d.problem.graph), d) for d in demonstrations]

    def order(problem: SequencingProblem) -> Sequence:
        rows = rows_of(problem.graph)
        alike = [(r, d) for r, d in known if [len(x) for x in r] == [len(x) for x in rows]]
        if not alike:
            return tuple(a for row in rows for a in middle_first(row))
        near, demonstration = min(alike, key=lambda pair: _difference(problem.graph, rows, pair[1].problem.graph, pair[0]))
        place = {a: (i, j) for i, row in enumerate(near) for j, a in enumerate(row)}
        return tuple(rows[i][j] for i, j in (place[a] for a in demonstration.sequence))

    return Learned(order, None)


def draw_weights(demonstrations: list[LearningDemonstration], generator: np.random.Generator) -> Learned:
    """Weights drawn from an exponential distribution, whatever the demonstrations say."""
    size = len(demonstrations[0].problem.columns)
    return by_weights(demonstrations, generator.exponential(size=size), (True,) * size)


def rows_of(graph: RegionGraph) -> Rows:
    """Regions row by row, top row first, left to right; real tables list (row, column), others boxes in plan view."""
    middle, extent = (graph.low + graph.high) / 2, graph.high - graph.low
    down, across = (middle[:, 0], middle[:, 1]) if graph.source == "real" else (-middle[:, 1], middle[:, 0])
    height = np.ones(graph.n) if graph.source == "real" else extent[:, 1]
    rows: Rows = []
    for a in sorted(range(graph.n), key=lambda a: (down[a], across[a])):
        first = rows[-1][0] if rows else None
        if first is not None and down[a] - down[first] < SAME_ROW * min(height[a], height[first]):
            rows[-1].append(a)
        else:
            rows.append([a])
    return [sorted(row, key=lambda a: across[a]) for row in rows]


def middle_first(row: list[int]) -> list[int]:
    """The middle of a row, then outwards, left before right."""
    centre = (len(row) - 1) / 2
    return [row[j] for j in sorted(range(len(row)), key=lambda j: (abs(j - centre), j))]


def _difference(one: RegionGraph, rows: Rows, other: RegionGraph, others: Rows) -> float:
    """How unlike two tools of the same rows are in height and curvature."""
    first, second = _attributes(one, rows), _attributes(other, others)
    return float(np.abs(first - second).sum())


def _attributes(graph: RegionGraph, rows: Rows) -> Array:
    order = [a for row in rows for a in row]
    spread = max(float(np.ptp(graph.curvature)), 1e-9)
    return np.stack([graph.height[order] / max(float(graph.height.max()), 1e-9), graph.curvature[order] / spread])
