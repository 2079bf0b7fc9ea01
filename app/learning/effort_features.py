"""z: where a sequence starts and ends (Sec. IV-E), and the effort penalty eta = w_z . z on top of the cost (Eq. 8)."""

import numpy as np

from app.learning.qp import Array
from app.sequencing.problem import SequencingProblem
from app.sequencing.shortest import Ends

EFFORT_COLUMNS: tuple[tuple[str, str], ...] = (
    ("start_right", "Starts far right"),
    ("start_left", "Starts far left"),
    ("start_back", "Starts far back"),
    ("start_front", "Starts far front"),
    ("end_right", "Ends far right"),
    ("end_left", "Ends far left"),
    ("end_back", "Ends far back"),
    ("end_front", "Ends far front"),
)


def effort_features(problem: SequencingProblem, sequence: tuple[int, ...]) -> Array:
    """z(xi) = (x, 1 - x, y, 1 - y) of the first region, then of the last, shape (8,).

    x and y are the region centres in plan view, scaled to the box around all centres of the tool; 0.5 where that box is flat.

    Paper: the centre of a region's plan box stands for its centroid (region tables list no other). Real tables give (row, column);
        x is the column there. The authors' code trains the start only; the paper names both.
    """
    place = _places(problem)
    return np.concatenate([[x, 1 - x, y, 1 - y] for x, y in (place[sequence[0]], place[sequence[-1]])])


def effort_ends(problem: SequencingProblem, effort_weights: Array) -> Ends:
    """eta as the sum of what the first and the last region add, which settles ties exactly however many there are."""
    place, w = _places(problem), np.asarray(effort_weights, np.float64)
    z = np.stack([place[:, 0], 1 - place[:, 0], place[:, 1], 1 - place[:, 1]], axis=1)
    return Ends(z @ w[:4], z @ w[4:])


def _places(problem: SequencingProblem) -> Array:
    """(N, 2) x and y of the region centres, scaled to the box around them."""
    centre = (problem.graph.low + problem.graph.high) / 2
    if problem.graph.source == "real":
        centre = centre[:, ::-1]
    low, extent = centre.min(axis=0), np.ptp(centre, axis=0)
    return np.where(extent > 0, (centre - low) / np.where(extent > 0, extent, 1.0), 0.5)


def effort_penalty(problem: SequencingProblem, effort_weights: Array, sequence: tuple[int, ...]) -> float:
    """eta(xi) = w_z . z(xi); low is little effort."""
    return float(np.asarray(effort_weights) @ effort_features(problem, sequence))
