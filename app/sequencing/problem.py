"""A tool's sequencing problem: feature values of every transition, their sums along a sequence, and costs (Eq. 1-2)."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from app.errors import IncompleteSequence, InvalidInput
from app.geometry.tool import Array, RegionGraph, region_letters
from app.sequencing import kernels
from app.sequencing.features import (
    DEFAULT_INTERACTIONS,
    Feature,
    FeatureSet,
    Interaction,
    Sets,
    feature_set_for,
    feature_values,
    interaction_column,
    interaction_values,
)
from app.sequencing.last import LastFeature

TENSOR_LIMIT = 14  # regions: the table of all transitions takes 24 MB for 13 columns
EXACT_LIMIT = 20  # regions: the table of all costs takes 168 MB
CHUNK = 512  # sets evaluated at a time: their features stay in the cache


@dataclass(frozen=True, eq=False)
class SequencingProblem:
    """Which features count on which tool. Tables are built on first use and left out when the value is pickled."""

    graph: RegionGraph
    features: FeatureSet
    interactions: tuple[Interaction, ...] = DEFAULT_INTERACTIONS
    last: tuple[LastFeature, ...] = ()  # columns that depend on the region before
    columns: tuple[Feature, ...] = field(init=False)  # n features, then m interactions, then those of `last`
    kept: dict[str, Any] = field(default_factory=dict, init=False, repr=False)

    def __post_init__(self) -> None:
        added = tuple(interaction_column(k, i, self.features) for k, i in enumerate(self.interactions))
        object.__setattr__(self, "columns", self.features.columns + added + tuple(f.feature for f in self.last))

    def __reduce__(self) -> tuple[type, tuple[RegionGraph, FeatureSet, tuple[Interaction, ...], tuple[LastFeature, ...]]]:
        return type(self), (self.graph, self.features, self.interactions, self.last)

    @property
    def n(self) -> int:
        """Number of regions."""
        return self.graph.n

    def values(self, done: Sets) -> Array:
        """phi and phi_int for every set (M, N) and every region, (M, N, n + m); meaningless where already done."""
        phi = feature_values(self.graph, self.features, done)
        return np.concatenate([phi, interaction_values(self.features, self.interactions, phi)], axis=-1)

    @property
    def width(self) -> int:
        """Number of columns that don't depend on the region before."""
        return len(self.columns) - len(self.last)

    def tensor(self) -> Array:
        """phi and phi_int of all transitions, (2^N, N, n + m), NaN where the region is already done. Don't write into it."""
        if self.n > TENSOR_LIMIT:
            raise InvalidInput(f"The table of all transitions is kept for at most {TENSOR_LIMIT} regions; this tool has {self.n}.")
        if "tensor" not in self.kept:
            sets = all_sets(self.n)
            table = np.concatenate([self.values(sets[i : i + CHUNK]) for i in range(0, len(sets), CHUNK)])
            table[sets] = np.nan
            table.flags.writeable = False
            self.kept["tensor"] = table
        return self.kept["tensor"]

    def cost_table(self, w: Array) -> Array:
        """Cost of every transition under weights w (n + m,), (2^N, N), NaN where already done."""
        if self.n > EXACT_LIMIT:
            raise InvalidInput(f"The table of all costs is built for at most {EXACT_LIMIT} regions; this tool has {self.n}.")
        w = self.check_weights(w)
        if self.n <= TENSOR_LIMIT:
            return self.tensor() @ w
        table = np.empty((1 << self.n, self.n))
        for start in range(0, len(table), CHUNK):
            sets = sets_from(start, CHUNK, self.n)
            block = self.values(sets) @ w
            block[sets] = np.nan
            table[start : start + CHUNK] = block
        return table

    def step_features(self, sequence: Sequence[int]) -> Array:
        """phi and phi_int of each step, (N, n + m), in the order of the sequence."""
        order = np.array(check_sequence(sequence, self.n), np.int64)
        if self.n <= TENSOR_LIMIT and not self.last:
            self.tensor()
        return self.steps_of(order)

    def steps_of(self, order: Sequence[int] | NDArray[np.int64]) -> Array:
        """The same for an order that may leave regions out, (len, n + m)."""
        order = np.asarray(order, np.int64)
        if not len(order):
            return np.zeros((0, len(self.columns)))
        if "tensor" in self.kept and not self.last:
            bits = np.int64(1) << order
            return self.kept["tensor"][np.cumsum(bits) - bits, order]
        done = np.zeros((len(order), self.n), np.bool_)
        for k, a in enumerate(order[:-1]):
            done[k + 1 :, a] = True
        steps = self.values(done)[np.arange(len(order)), order]
        extra = [np.concatenate([[f.start[order[0]]], f.between[order[:-1], order[1:]]]) for f in self.last]
        return np.column_stack([steps, *extra]) if extra else steps

    def sums_of(self, order: Sequence[int]) -> Array:
        """Features added along an order that may leave regions out, (n + m,)."""
        if "tensor" in self.kept and not self.last:
            return kernels.sums_along(self.kept["tensor"], np.array(order, np.int64))
        return np.add.reduce(self.steps_of(order))

    def cost_of(self, w: Array, order: Sequence[int]) -> float:
        """Cost of an order that may leave regions out."""
        return float(self.check_weights(w) @ self.sums_of(order))

    def feature_sum(self, sequence: Sequence[int]) -> Array:
        """Phi(xi), shape (n + m,): features added along the sequence."""
        return self.step_features(sequence).sum(axis=0)

    def cost(self, w: Array, sequence: Sequence[int]) -> float:
        """C(xi) = w . Phi(xi) (Eq. 2); low is good."""
        return float(self.check_weights(w) @ self.feature_sum(sequence))

    def check_weights(self, w: Array) -> Array:
        """w as a float64 vector with one finite entry per column."""
        w = np.asarray(w, np.float64)
        if w.shape != (len(self.columns),) or not all(np.isfinite(w).tolist()):  # quicker than numpy for so few
            raise InvalidInput(f"Expected {len(self.columns)} finite weights, one per feature and interaction.")
        return w


def problem_for(graph: RegionGraph, interactions: tuple[Interaction, ...] = DEFAULT_INTERACTIONS) -> SequencingProblem:
    """The problem under the feature set that belongs to the graph."""
    return SequencingProblem(graph, feature_set_for(graph), interactions)


def all_sets(n: int) -> Sets:
    """(2^n, n) members of every bit mask."""
    return sets_from(0, 1 << n, n)


def sets_from(start: int, count: int, n: int) -> Sets:
    """Members of the bit masks start, start + 1, ... of n regions."""
    masks: NDArray[np.int64] = np.arange(start, min(start + count, 1 << n))
    return ((masks[:, None] >> np.arange(n)) & 1).astype(np.bool_)


def check_sequence(sequence: Sequence[int], n: int) -> tuple[int, ...]:
    """The sequence as plain ints if it holds each of the n regions once.

    Raises:
        IncompleteSequence: Names the regions that are missing, repeated or unknown.
    """
    order, letters = tuple(int(a) for a in sequence), region_letters(n)
    unknown = sorted({a for a in order if not 0 <= a < n})
    if unknown:
        raise IncompleteSequence(f"There is no region number {unknown[0]}; this tool has {n} regions, numbered 0 to {n - 1}.")
    repeated = [letters[a] for a in range(n) if order.count(a) > 1]
    missing = [letters[a] for a in range(n) if a not in order]
    faults = [f"{_listed(names)} {what}" for names, what in ((repeated, "more than once"), (missing, "missing")) if names]
    if faults:
        raise IncompleteSequence(f"The sequence must hold every region once: {'; '.join(faults)}.")
    return order


def _listed(names: list[str]) -> str:
    return ", ".join(names[:-1]) + " and " + names[-1] if len(names) > 1 else names[0]
