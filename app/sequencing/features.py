"""The paper's ten features of a transition (Sec. IV-A) for many sets of finished regions at once, in three definitions.

`clean` is the product's own set for meshes, every value in [0, 1]; the height step is split into up and down, so it has
eleven columns. `authors-real` and `authors-synthetic` give the values of the authors' published code, quirks included.
Weights mean nothing under another set or version.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from app.errors import UnknownFeature
from app.geometry.tool import Array, RegionGraph
from app.sequencing.kernels import box_gaps
from app.sequencing.layout import COLUMNS as LAYOUT_COLUMNS
from app.sequencing.layout import layout_values

Sets = NDArray[np.bool_]  # (M, N) one set of finished regions per row


@dataclass(frozen=True)
class Feature:
    """One column of the feature vector."""

    key: str
    label: str  # plain words
    symbol: str  # "phi_1"


@dataclass(frozen=True)
class FeatureSet:
    """A named, versioned definition of all columns."""

    name: str
    version: int
    columns: tuple[Feature, ...]
    factors: dict[str, tuple[int, ...]]  # what interactions are made of: key -> columns whose sum is the factor


@dataclass(frozen=True)
class Interaction:
    """The product of two factors at a transition (Eq. 1)."""

    first: str
    second: str


DEFAULT_INTERACTIONS = (Interaction("height", "curvature"), Interaction("orientation", "curvature"))
FACTOR_WORDS = {"height": "height", "curvature": "curvature", "orientation": "orientation", "jump": "jump"}

_NINE = (
    Feature("borders_unfinished", "Borders with unfinished neighbours", "phi_1"),
    Feature("borders_finished", "Borders with finished neighbours", "phi_2"),
    Feature("opposite_unfinished", "Unfinished opposite an outer edge", "phi_3"),
    Feature("opposite_finished", "Finished opposite an outer edge", "phi_4"),
    Feature("jump", "Jump", "phi_5"),
    Feature("gaps_inside", "Gaps in what is finished", "phi_6"),
    Feature("gaps_left", "Gaps left behind", "phi_7"),
    Feature("curvature", "Change of curvature", "phi_8"),
    Feature("orientation", "Turn towards neighbours", "phi_9"),
)
_HEIGHT = (Feature("height", "Change of height", "phi_10"),)
_UP_DOWN = (Feature("height_up", "Step up in height", "phi_10"), Feature("height_down", "Step down in height", "phi_11"))


def _set(name: str, columns: tuple[Feature, ...]) -> FeatureSet:
    factors: dict[str, tuple[int, ...]] = {c.key: (i,) for i, c in enumerate(columns)}
    tall = tuple(i for i, c in enumerate(columns) if c.key.startswith("height"))
    if tall:
        factors.setdefault("height", tall)
    return FeatureSet(name, 1, columns, factors)


FEATURE_SETS: dict[str, FeatureSet] = {
    "clean": _set("clean", _NINE + _UP_DOWN),
    "authors-real": _set("authors-real", _NINE + _HEIGHT),
    "authors-synthetic": _set("authors-synthetic", _NINE + _HEIGHT),
    "layout": _set("layout", tuple(Feature(*column) for column in LAYOUT_COLUMNS)),
}
_BY_SOURCE = {"mesh": "clean", "real": "authors-real", "synthetic": "authors-synthetic"}


def feature_set_for(graph: RegionGraph) -> FeatureSet:
    """The set that belongs to where the graph came from."""
    return FEATURE_SETS[_BY_SOURCE[graph.source]]


def factor_label(key: str, feature_set: FeatureSet) -> str:
    """What people call a factor inside a sentence."""
    if key not in feature_set.factors:
        raise UnknownFeature(f"There is no feature '{key}'. Choose from: {', '.join(sorted(feature_set.factors))}.")
    if key in FACTOR_WORDS:
        return FACTOR_WORDS[key]
    label = next(c.label for c in feature_set.columns if c.key == key)
    return label[0].lower() + label[1:]


def interaction_label(interaction: Interaction, feature_set: FeatureSet) -> str:
    """'height and curvature'."""
    return f"{factor_label(interaction.first, feature_set)} and {factor_label(interaction.second, feature_set)}"


def interaction_column(index: int, interaction: Interaction, feature_set: FeatureSet) -> Feature:
    """The column an interaction adds to the feature vector; `index` counts from 0."""
    label = interaction_label(interaction, feature_set)
    return Feature(f"{interaction.first}*{interaction.second}", label[0].upper() + label[1:], f"phi_int_{index + 1}")


def interaction_values(feature_set: FeatureSet, interactions: tuple[Interaction, ...], values: Array) -> Array:
    """Products of factors (Eq. 1), shape (..., m), from feature values of shape (..., n)."""
    columns = [_factor(feature_set, i.first, values) * _factor(feature_set, i.second, values) for i in interactions]
    return np.stack(columns, axis=-1) if columns else np.zeros((*values.shape[:-1], 0))


def _factor(feature_set: FeatureSet, key: str, values: Array) -> Array:
    return values[..., list(feature_set.factors[key])].sum(axis=-1)


def feature_values(graph: RegionGraph, feature_set: FeatureSet, done: Sets) -> Array:
    """phi(s, a) for every set s in `done` (M, N) and every region a, shape (M, N, n).

    Values where a is already in s are filled but mean nothing.

    Paper: phi_1 + phi_2 and phi_3 + phi_4 are constants of a region, so their sums over a complete sequence never differ;
    the learner leaves one of each pair out.
    """
    return _DEFINITIONS[feature_set.name](graph, done)


@dataclass(frozen=True)
class _Progress:
    """What the features need to know of each finished set."""

    member: Array  # (M, N) 0 or 1
    count: Array  # (M, 1) at least 1
    started: NDArray[np.bool_]  # (M, 1)
    edge: NDArray[np.bool_]  # (M, N) region a touches a finished one along an edge
    corner: NDArray[np.bool_]  # (M, N) region a touches a finished one at a corner only


def _progress(graph: RegionGraph, done: Sets) -> _Progress:
    member = done.astype(np.float64)
    size = member.sum(axis=1, keepdims=True)
    edge, corner = member @ graph.neighbour.T.astype(np.float64), member @ graph.corner.T.astype(np.float64)
    return _Progress(member, np.maximum(size, 1), size > 0, edge > 0.5, corner > 0.5)


def _borders(graph: RegionGraph, p: _Progress) -> list[Array]:
    """phi_1 to phi_4: how much of a's border is free or taken, and the same opposite to its outer edges."""
    taken, facing = p.member @ graph.shared.T, p.member @ graph.opposite.T
    return [graph.shared.sum(axis=1) - taken, taken, graph.opposite.sum(axis=1) - facing, facing]


def _clean(graph: RegionGraph, done: Sets) -> Array:
    """The product's definitions: dimensionless, in [0, 1], the same on a mesh in any position and size.

    Paper: phi_10 is split into a step up and a step down; the learner finds the asymmetry that the authors typed in
    (99 to 21, 3 to 1). The static 1 / z term is left out: over a complete sequence it is a constant.
    """
    p = _progress(graph, done)
    curve, rise = graph.curvature - _mean(p, graph.curvature), graph.height - _mean(p, graph.height)
    jump = np.where(~p.started | p.edge, 0.0, np.where(p.corner, 1 / 3, 1.0))
    share = graph.shared / np.maximum(graph.shared.sum(axis=1, keepdims=True), 1e-30)
    pull = share * graph.angle / (2 * math.pi)
    inside, left = _gaps(graph, done), _gaps(graph, ~done)
    columns = [
        *_borders(graph, p),
        jump,
        np.broadcast_to(inside[:, None], done.shape),
        np.broadcast_to(np.where(p.started, left[:, None], 0.0), done.shape),
        np.where(p.started, np.abs(curve) / 2, np.abs(graph.curvature)),
        0.5 + pull.sum(axis=1) - 2 * p.member @ pull.T,
        np.where(p.started, np.maximum(0, rise), 0.0),
        np.where(p.started, np.maximum(0, -rise), 0.0),
    ]
    return np.stack(columns, axis=-1)


def _authors_real(graph: RegionGraph, done: Sets) -> Array:
    """The authors' code on their scanned tools.

    Paper: the corner test runs inside their loop over listed neighbours, so a corner wins unless the first listed
    neighbour is finished; the first curvature is signed; a step up costs 99, a step down 21.
    """
    p = _progress(graph, done)
    listed = graph.first >= 0
    first_done = listed & done[:, np.maximum(graph.first, 0)]
    jump = np.where(first_done, 0.0, np.where(p.corner & listed, 5.0, np.where(p.edge, 0.0, 15.0)))
    fall = _mean(p, np.abs(graph.height)) - graph.height
    step = np.where(p.started, np.where(fall < 0, -99 * fall, 21 * fall), 0.0)
    inside, left = _gaps(graph, done), _gaps(graph, ~done)
    columns = [
        *_borders(graph, p),
        jump,
        np.broadcast_to(inside[:, None], done.shape),
        np.broadcast_to(np.where(p.started, left[:, None], 0.0), done.shape),
        np.where(p.started, np.abs(graph.curvature - _mean(p, graph.curvature)), graph.curvature),
        math.pi + graph.angle.sum(axis=1) - 2 * p.member @ graph.angle.T,
        step + 5 / graph.height,
    ]
    return np.stack(columns, axis=-1)


def _authors_synthetic(graph: RegionGraph, done: Sets) -> Array:
    """The authors' code on their synthetic tools.

    Paper: phi_7 is evaluated on the finished set too, so it repeats phi_6; the inverse height of a level region is 0.
    """
    p = _progress(graph, done)
    jump = np.where(p.edge | ~p.started, 0.0, np.where(p.corner, 5.0, 15.0))
    fall = _mean(p, np.abs(graph.height)) - graph.height
    level = graph.height == 0
    inverse = np.where(level, 0.0, 1 / np.where(level, 1.0, graph.height))
    step = (np.where(fall < 0, -3 * fall, fall) + inverse) / 2
    rise = np.maximum(0, graph.curvature - _mean(p, graph.curvature))
    inside = np.broadcast_to(_gaps(graph, done)[:, None], done.shape)
    columns = [
        *_borders(graph, p),
        jump,
        inside,
        inside,
        np.where(p.started, rise, np.abs(graph.curvature)),
        graph.angle.sum(axis=1) - p.member @ graph.angle.T,
        np.where(p.started, step, np.abs(inverse)),
    ]
    return np.stack(columns, axis=-1)


def _mean(p: _Progress, values: Array) -> Array:
    """Mean over each finished set, (M, 1)."""
    return (p.member @ values)[:, None] / p.count


def _gaps(graph: RegionGraph, inside: Sets) -> Array:
    """1 - area(S) / area(box of S) for each set (M, N) -> (M,); 0 for at most one region.

    The box's area is what the authors take it for: real tables the regions whose (row, column) lies in it, synthetic
    tables its width by height. For meshes it is the share of each region's own box that lies in it, times the region's
    area: within the tool's outline, never below the area of S, and the same as the real tables' on a grid.
    """
    # stored arrays may be read-only, which the kernel would be compiled for once more
    low, high, area = (np.require(x, np.float64, ["C", "W"]) for x in (graph.low, graph.high, graph.area))
    return box_gaps(np.require(inside, np.bool_, ["C", "W"]), low, high, area, graph.source == "synthetic")


_DEFINITIONS: dict[str, Callable[[RegionGraph, Sets], Array]] = {
    "clean": _clean,
    "authors-real": _authors_real,
    "authors-synthetic": _authors_synthetic,
    "layout": layout_values,
}
