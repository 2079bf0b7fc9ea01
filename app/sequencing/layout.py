"""Features of how regions lie together on a tool: which are alike, which border each other, which edge falls which way.

The paper's ten features compare a region with the mean of what is finished and weigh borders by their listed lengths. What
experts visibly do on the real tools is different: they finish a strip of like regions before they leave it, begin in its
middle, and go down over edges. These ten columns say that. They are the same under rotation, mirroring and renaming, and
small differences of hand-typed scores, angles and heights don't change them, so mirrored orders cost the same.

Every column is a value per transition, so any policy on them is an ordinary policy: exact sequencing, tie counts and
explanations work on it unchanged.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from app.geometry.tool import Array, RegionGraph

SHARP = np.radians(20.0)  # an edge this sharp separates two regions for good, and falls as much as any
STEP = 0.25  # of the tool's height: regions this far apart in height have nothing in common
CURVATURE = {"real": (1.0, 4.0), "synthetic": (0.1, 0.4), "mesh": (0.1, 0.4)}  # differences that mean nothing, and everything beyond that
COLUMNS = (
    ("falling_edge", "Upper side of an edge left for later", "psi_1"),
    ("like_waiting", "Like neighbours kept waiting", "psi_2"),
    ("open_border", "Border between finished and unfinished", "psi_3"),
    ("inside_late", "Middle of like regions late", "psi_4"),
    ("hub_late", "Region with many neighbours late", "psi_5"),
    ("apart", "Away from what is finished", "psi_6"),
    ("like_finished", "Like neighbours finished", "psi_7"),
    ("neighbours_finished", "Neighbours finished", "psi_8"),
    ("inside_first", "Start in the middle of like regions", "psi_9"),
    ("hub_first", "Start at many neighbours", "psi_10"),
)


@dataclass(frozen=True)
class Layout:
    """What the columns need to know of a tool; matrices [a, b] are symmetric unless said."""

    neighbour: Array  # (N, N) 1 where they share a border
    alike: Array  # (N, N) 0 to 1: same height, same curvature, no edge between them; 0 where they don't touch
    falls: Array  # (N, N) antisymmetric, -1 to 1; negative: a is the upper side of the edge to b
    borders: float  # number of borders, at least 1
    bonds: float  # likeness added over all borders


def layout_of(graph: RegionGraph) -> Layout:
    """Borders, likeness and edges of a tool.

    Paper: the listed angles of the two sides of an edge often disagree in the authors' tables; here they are averaged,
        (angle_ab - angle_ba) / 2. Synthetic tables list 1 / |difference|, which has no direction: no edge falls there.
    """
    neighbour = (graph.neighbour | graph.neighbour.T).astype(np.float64)
    directed = graph.source != "synthetic"
    falls = np.clip((graph.angle - graph.angle.T) / 2 / SHARP, -1, 1) * neighbour * directed
    edge = np.minimum((np.abs(graph.angle) + np.abs(graph.angle.T)) / 2 / SHARP, 1) * directed
    height = graph.height / max(float(np.abs(graph.height).max()), 1e-12)
    nothing, everything = CURVATURE[graph.source]
    bend = np.clip((_apart(graph.curvature) - nothing) / everything, 0, 1)
    alike = neighbour * (1 - np.minimum(_apart(height) / STEP, 1)) * (1 - bend) * (1 - edge)
    return Layout(neighbour, alike, falls, max(neighbour.sum() / 2, 1.0), max(alike.sum() / 2, 1e-9))


def layout_values(graph: RegionGraph, done: NDArray[np.bool_]) -> Array:
    """The ten columns for every set (M, N) and every region, (M, N, 10); meaningless where already done."""
    own = layout_of(graph)
    finished = done.astype(np.float64)
    waiting = 1 - finished
    count = finished.sum(axis=1, keepdims=True)
    late, start = count / max(graph.n - 1, 1), (count == 0).astype(np.float64)
    degree, bonds = own.neighbour.sum(axis=1), own.alike.sum(axis=1)
    touched = finished @ own.neighbour
    columns = [
        waiting @ ((own.neighbour + own.falls) / 2).T / own.borders,
        (finished @ own.alike * waiting).sum(axis=1, keepdims=True) / own.bonds,
        (touched * waiting).sum(axis=1, keepdims=True) / own.borders,
        late * bonds / 4,
        late * degree / 4,
        ((touched < 0.5) & (count > 0)).astype(np.float64),
        finished @ own.alike / np.maximum(bonds, 1e-9),
        touched / np.maximum(degree, 1),
        start * bonds / 4,
        start * degree / 4,
    ]
    return np.stack([np.broadcast_to(c, done.shape) for c in columns], axis=-1)


def _apart(values: Array) -> Array:
    """|difference| of every two regions."""
    return np.abs(values[:, None] - values[None, :])
