"""The paper's ten features of a transition (Sec. IV-A) for many sets of finished regions at once, in three definitions.

`clean` is the product's own set for meshes, every value in [0, 1]; the height step is split into up and down, so it has
eleven columns. `authors-real` and `authors-synthetic` give the values of the authors' published code, quirks included.
`layout` (its own module) is ours, for any tool: how regions lie together instead of how they compare with the mean.
Weights mean nothing under another set or version.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

import numpy as np

from app.errors import UnknownFeature
from app.geometry.tool import Array, RegionGraph
from app.sequencing.layout import COLUMNS as LAYOUT_COLUMNS
from app.sequencing.layout import layout_of
from app.sequencing.structure import Between, Declaration, FirstTouch, Gap, MeanStep, Pairwise, Plugin, Rank, Sets, Undeclared, evaluate


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
    plugins: tuple[Plugin, ...] = ()  # what computes the last columns, which declare no structure


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
    return evaluate(declare(graph, feature_set), done)


def declare(graph: RegionGraph, feature_set: FeatureSet) -> tuple[Declaration, ...]:
    """How each column depends on what is finished."""
    base = base_name(feature_set.name)
    columns = zip(FEATURE_SETS[base].columns, _DEFINITIONS[base](graph), strict=True)
    kept = (declaration for column, declaration in columns if column in feature_set.columns)
    return (*kept, *(Undeclared(p, graph) for p in feature_set.plugins))


def base_name(name: str) -> str:
    """The built-in set that a choice of features starts from (`choice`)."""
    return name.split("~")[0].split("+")[0]


def _borders(graph: RegionGraph) -> tuple[Declaration, ...]:
    """phi_1 to phi_4: how much of a's border is free or taken, and the same opposite to its outer edges."""
    none, facing = np.zeros(graph.n), graph.opposite
    return (
        Pairwise(graph.shared.sum(axis=1), -graph.shared),
        Pairwise(none, graph.shared),
        Pairwise(facing.sum(axis=1), -facing),
        Pairwise(none, facing),
    )


def _gap(graph: RegionGraph, of: Literal["done", "left"]) -> Gap:
    """How full the box around a set is; nothing is left behind before the first region.

    The box's area is what the authors take it for: real tables the regions whose (row, column) lies in it, synthetic
    tables its width by height. For meshes it lies within the tool's outline, the same as the real tables' on a grid.
    """
    shape = "plain" if graph.source == "synthetic" else "within"
    return Gap(graph.low, graph.high, graph.area, of, shape, np.zeros(graph.n))


def _clean(graph: RegionGraph) -> tuple[Declaration, ...]:
    """The product's definitions: dimensionless, in [0, 1], the same on a mesh in any position and size.

    Paper: phi_10 is split into a step up and a step down; the learner finds the asymmetry that the authors typed in
    (99 to 21, 3 to 1). The static 1 / z term is left out: over a complete sequence it is a constant.
    """
    none = np.zeros(graph.n)
    share = graph.shared / np.maximum(graph.shared.sum(axis=1, keepdims=True), 1e-30)
    pull = share * graph.angle / (2 * math.pi)
    return (
        *_borders(graph),
        FirstTouch(((graph.neighbour, 0.0), (graph.corner, 1 / 3)), 1.0, none),
        _gap(graph, "done"),
        _gap(graph, "left"),
        MeanStep(graph.curvature, graph.curvature, 0.5, 0.5, none, np.abs(graph.curvature)),
        Pairwise(0.5 + pull.sum(axis=1), -2 * pull),
        MeanStep(graph.height, graph.height, 1.0, 0.0, none, none),
        MeanStep(graph.height, graph.height, 0.0, 1.0, none, none),
    )


def _authors_real(graph: RegionGraph) -> tuple[Declaration, ...]:
    """The authors' code on their scanned tools.

    Paper: the corner test runs inside their loop over listed neighbours, so a corner wins unless the first listed
    neighbour is finished; the first curvature is signed; a step up costs 99, a step down 21.
    """
    listed = graph.first >= 0
    first = np.zeros((graph.n, graph.n), np.bool_)
    first[listed, graph.first[listed]] = True
    static = 5 / graph.height
    return (
        *_borders(graph),
        FirstTouch(((first, 0.0), (graph.corner & listed[:, None], 5.0), (graph.neighbour, 0.0)), 15.0),
        _gap(graph, "done"),
        _gap(graph, "left"),
        MeanStep(graph.curvature, graph.curvature, 1.0, 1.0, np.zeros(graph.n), graph.curvature),
        Pairwise(math.pi + graph.angle.sum(axis=1), -2 * graph.angle),
        MeanStep(np.abs(graph.height), graph.height, 99.0, 21.0, static, static),
    )


def _authors_synthetic(graph: RegionGraph) -> tuple[Declaration, ...]:
    """The authors' code on their synthetic tools.

    Paper: phi_7 is evaluated on the finished set too, so it repeats phi_6; the inverse height of a level region is 0.
    """
    level = graph.height == 0
    inverse = np.where(level, 0.0, 1 / np.where(level, 1.0, graph.height))
    return (
        *_borders(graph),
        FirstTouch(((graph.neighbour, 0.0), (graph.corner, 5.0)), 15.0, np.zeros(graph.n)),
        _gap(graph, "done"),
        _gap(graph, "done"),
        MeanStep(graph.curvature, graph.curvature, 1.0, 0.0, np.zeros(graph.n), np.abs(graph.curvature)),
        Pairwise(graph.angle.sum(axis=1), -graph.angle),
        MeanStep(np.abs(graph.height), graph.height, 1.5, 0.5, inverse / 2, np.abs(inverse)),
    )


def _layout(graph: RegionGraph) -> tuple[Declaration, ...]:
    """How regions lie together; `layout` says what each column means."""
    own, n = layout_of(graph), graph.n
    degree, bonds = own.neighbour.sum(axis=1), own.alike.sum(axis=1)
    none, still = np.zeros(n), np.zeros((n, n))
    waiting = (own.neighbour + own.falls) / 2 / own.borders
    late = np.arange(n)[:, None] / max(n - 1, 1)
    return (
        Pairwise(waiting.sum(axis=1), -waiting),
        Between(own.alike / own.bonds),
        Between(own.neighbour / own.borders),
        Rank(late * bonds / 4),
        Rank(late * degree / 4),
        FirstTouch(((own.neighbour > 0, 0.0),), 1.0, none),
        Pairwise(none, own.alike / np.maximum(bonds, 1e-9)[:, None]),
        Pairwise(none, own.neighbour / np.maximum(degree, 1)[:, None]),
        Pairwise(none, still, bonds / 4),
        Pairwise(none, still, degree / 4),
    )


_DEFINITIONS: dict[str, Callable[[RegionGraph], tuple[Declaration, ...]]] = {
    "clean": _clean,
    "authors-real": _authors_real,
    "authors-synthetic": _authors_synthetic,
    "layout": _layout,
}
