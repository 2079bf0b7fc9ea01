"""z: where a sequence starts and ends (Sec. IV-E), and the effort penalty eta = w_z . z on top of the cost (Eq. 8).

Two more columns can be switched on (`EffortParameters`): how long the ways between regions are, and how often the side changes.
"""

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

MORE_COLUMNS: tuple[tuple[str, str], ...] = (
    ("travel", "Long ways between regions"),
    ("side_changes", "Changes between left and right"),
)
ALL_COLUMNS = EFFORT_COLUMNS + MORE_COLUMNS


def effort_features(problem: SequencingProblem, sequence: tuple[int, ...]) -> Array:
    """z(xi) = (x, 1 - x, y, 1 - y) of the first region, then of the last, shape (8,).

    x and y are the region centres in plan view, scaled to the box around all centres of the tool; 0.5 where that box is flat.

    Paper: the centre of a region's plan box stands for its centroid (region tables list no other). Real tables give (row, column);
        x is the column there. The authors' code trains the start only; the paper names both.
    """
    place = _places(problem)
    return np.concatenate([[x, 1 - x, y, 1 - y] for x, y in (place[sequence[0]], place[sequence[-1]])])


def all_effort_features(problem: SequencingProblem, sequence: tuple[int, ...]) -> Array:
    """z with the columns that can be switched on, shape (10,), all in [0, 1].

    Travel is the mean way in plan view from one region's centre to the next, as a share of the diagonal of the box around them; a change
    of side is a step from the left half of the box to the right one or back, as a share of all steps (a region in the middle has the side
    of the one before).

    Paper: z is positional there; travel and side changes are the documented option of more.
    """
    place = _places(problem)[list(sequence)]
    steps = max(len(place) - 1, 1)
    way = float(np.linalg.norm(np.diff(place, axis=0), axis=1).sum()) / (steps * np.sqrt(2.0))
    sides = np.sign(np.round(place[:, 0] - 0.5, 9))
    sides = sides[sides != 0]
    return np.r_[effort_features(problem, sequence), way, float((np.diff(sides) != 0).sum()) / steps]


def only_ends(effort_weights: Array) -> bool:
    """Whether nothing but start and end has a penalty."""
    return not np.asarray(effort_weights)[len(EFFORT_COLUMNS) :].any()


def effort_ends(problem: SequencingProblem, effort_weights: Array) -> Ends:
    """eta as the sum of what the first and the last region add, which settles ties exactly however many there are."""
    place, w = _places(problem), np.asarray(effort_weights, np.float64)
    z = np.stack([place[:, 0], 1 - place[:, 0], place[:, 1], 1 - place[:, 1]], axis=1)
    return Ends(z @ w[:4], z @ w[4 : len(EFFORT_COLUMNS)])


def _places(problem: SequencingProblem) -> Array:
    """(N, 2) x and y of the region centres, scaled to the box around them."""
    centre = (problem.graph.low + problem.graph.high) / 2
    if problem.graph.source == "real":
        centre = centre[:, ::-1]
    low, extent = centre.min(axis=0), np.ptp(centre, axis=0)
    return np.where(extent > 0, (centre - low) / np.where(extent > 0, extent, 1.0), 0.5)


def effort_penalty(problem: SequencingProblem, effort_weights: Array, sequence: tuple[int, ...]) -> float:
    """eta(xi) = w_z . z(xi) with weights (8,) or (10,); low is little effort."""
    w = np.asarray(effort_weights)
    z = effort_features(problem, sequence) if only_ends(w) else all_effort_features(problem, sequence)
    return float(w[: len(z)] @ z)
