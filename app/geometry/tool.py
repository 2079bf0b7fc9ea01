"""The core values of the pipeline: a mesh, the regions it is cut into, and what the features need to know of them."""

from dataclasses import dataclass
from functools import lru_cache
from typing import Literal

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
GraphSource = Literal["mesh", "real", "synthetic"]


@dataclass(frozen=True)
class Mesh:
    """A welded triangle mesh in the tool frame: metres, +Z up (the tool's up-direction is already applied)."""

    vertices: Array  # (V, 3) metres
    faces: NDArray[np.int32]  # (F, 3) vertex indices, outward winding


@dataclass(frozen=True)
class RegionGraph:
    """Everything the features need; matrices are indexed [action region a, other region b].

    `source` says which definitions the numbers follow: "mesh" the product's own (all dimensionless, clean ranges),
    "real" and "synthetic" the authors' region tables, read as their code reads them.
    """

    source: GraphSource
    shared: Array  # (N, N) shared border length / perimeter of a
    opposite: Array  # (N, N) length of b lying opposite to a boundary side of a / perimeter of a (synthetic: / half perimeter)
    # (N, N) mesh: antisymmetric change of tilt towards b, rad; real: neighbour angle, rad; synthetic: 1/|difference of angles|
    angle: Array
    neighbour: NDArray[np.bool_]  # (N, N) shares a border
    corner: NDArray[np.bool_]  # (N, N) shares a corner only
    first: NDArray[np.int64]  # (N,) first listed neighbour, -1 without one
    curvature: Array  # (N,) mesh: clip(kappa * sqrt(total area), -1, 1), + convex; tables: as listed
    height: Array  # (N,) mesh: highest point scaled to [0, 1] over the working surface; tables: z_max as listed
    area: Array  # (N,) mesh: projected area / total projected area; tables: area as listed
    low: Array  # (N, 2) lower corner of the region's box in plan view, mesh: along the part's tightest rectangle (real: row, column)
    high: Array  # (N, 2) upper corner

    @property
    def n(self) -> int:
        return len(self.area)


@dataclass(frozen=True)
class Region:
    """One patch of a tool as people see it. The index in `Tool.regions` is the region id used in sequences."""

    name: str  # editable letter or word: A, B, ... Z, AA
    description: str  # plain words: "Floor, middle"
    centroid: Array  # (3,) area centroid, metres
    normal: Array  # (3,) unit, area mean
    area: float  # m^2
    curvature: float  # signed dominant principal curvature, 1/m (tables: as listed)
    kind: str  # "plane" | "cylinder" | "cone" | "sphere" | "curved" (one general quadric) | "freeform" | "listed"


@dataclass(frozen=True)
class Tool:
    """A part cut into regions: what is shown, sequenced and executed."""

    mesh: Mesh  # the whole part
    labels: NDArray[np.int32]  # (F,) region id of each face, -1 outside the working surface
    regions: tuple[Region, ...]
    graph: RegionGraph

    @property
    def n(self) -> int:
        return len(self.regions)


@lru_cache
def region_letters(n: int) -> tuple[str, ...]:
    """A..Z, then AA, AB, ..."""
    names: list[str] = []
    for i in range(n):
        name, k = "", i + 1
        while k:
            k, r = divmod(k - 1, 26)
            name = chr(65 + r) + name
        names.append(name)
    return tuple(names)
