"""Small made-up region graphs, and every order of their regions as the yardstick."""

import itertools

import numpy as np

from app.geometry.tool import GraphSource, RegionGraph
from app.sequencing.problem import SequencingProblem


def grid_graph(rows: int, columns: int, seed: int | None, source: GraphSource = "mesh") -> RegionGraph:
    """Unit squares in a grid; without a seed mirror-symmetric, so that many sequences cost the same."""
    rng, n = np.random.default_rng(seed), rows * columns
    row, column = np.divmod(np.arange(n), columns)
    down, across = abs(row[:, None] - row), abs(column[:, None] - column)
    edge, corner = down + across == 1, (down == 1) & (across == 1)
    opposite = np.zeros((n, n))
    for a, b in np.argwhere(edge):
        outer = row[a] in (0, rows - 1) if down[a, b] else column[a] in (0, columns - 1)
        opposite[a, b] = 0.25 if outer else 0.0
    tilt = rng.uniform(-0.6, 0.6, n) if seed is not None else np.minimum(column, columns - 1 - column) * 0.3
    curvature = rng.uniform(-1, 1, n) if seed is not None else (np.minimum(column, columns - 1 - column) % 2) * 0.7
    height = rng.uniform(0.05, 1, n) if seed is not None else 1.0 - 0.8 * row / max(rows - 1, 1)
    area = rng.uniform(0.5, 1, n) if seed is not None else np.ones(n)
    low = np.stack([column, row], axis=1).astype(float)
    extent = 0.0 if source == "real" else 1.0
    first = np.array([np.flatnonzero(e)[0] if e.any() else -1 for e in edge])
    angle = (tilt[None, :] - tilt[:, None]) * edge
    area = area / area.sum() if source != "synthetic" else area
    return RegionGraph(source, edge / 4, opposite, angle, edge, corner, first, curvature, height, area, low, low + extent)


def step_by_step(problem: SequencingProblem, order: tuple[int, ...]) -> np.ndarray:
    """Feature sum without any table."""
    done, total = np.zeros((1, problem.n), np.bool_), np.zeros(len(problem.columns))
    for a in order:
        total = total + problem.values(done)[0, a]
        done[0, a] = True
    return total


def every_order(problem: SequencingProblem) -> tuple[list[tuple[int, ...]], np.ndarray]:
    """All orders and their feature sums."""
    tensor, orders = problem.tensor(), np.array(list(itertools.permutations(range(problem.n))))
    total, state = np.zeros((len(orders), tensor.shape[2])), np.zeros(len(orders), int)
    for a in orders.T:
        total += tensor[state, a]
        state |= 1 << a
    return [tuple(o) for o in orders.tolist()], total
