"""Low, middle and high values of each feature factor over a project's tools (Sec. IV-C)."""

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from app.errors import InvalidInput, UnknownFeature
from app.learning.qp import Array
from app.sequencing.features import FeatureSet
from app.sequencing.problem import SequencingProblem

ORDERS = 24  # random orders per tool whose steps stand for all transitions
SEED = 20230523  # fixed: the same tools always give the same levels
Rule = Literal["quantile", "range", "expert"]

BINS = 24  # slices of the range in which values are counted for people to look at

EVEN = 1e-9  # values this close (as a share of the range) are on the same side of a threshold


@dataclass(frozen=True)
class Transitions:
    """Sampled transitions of one tool."""

    values: Array  # (T, factors)
    region: NDArray[np.int64]  # (T,) the region worked on
    orders: tuple[NDArray[np.int64], ...]  # per sampled order, indices of its steps in `values`


@dataclass(frozen=True)
class LevelRules:
    """How the two thresholds of each factor are found."""

    default: Rule = "quantile"
    chosen: tuple[tuple[str, Rule], ...] = ()  # factors with another rule
    expert: tuple[tuple[str, float, float], ...] = ()  # factor, low, high: set by the expert

    def of(self, key: str) -> Rule:
        """The rule of a factor."""
        if any(key == name for name, *_ in self.expert):
            return "expert"
        return dict(self.chosen).get(key, self.default)


@dataclass(frozen=True)
class Spread:
    """How often which values of a factor occur on the tools at hand."""

    least: float
    most: float
    counts: tuple[int, ...]  # in BINS equal slices from the least to the most


@dataclass(frozen=True)
class Levels:
    """Two thresholds per factor and where they come from, stored with every report."""

    keys: tuple[str, ...]
    low: tuple[float, ...]  # at most this is level 0
    high: tuple[float, ...]  # above this is level 2
    rules: tuple[Rule, ...] = ()

    def of(self, values: Array) -> NDArray[np.int64]:
        """Level 0, 1 or 2 of factor values (..., factors)."""
        return (values > np.array(self.low)).astype(np.int64) + (values > np.array(self.high)).astype(np.int64)


def factor_groups(features: FeatureSet) -> dict[str, tuple[int, ...]]:
    """Factors that partition the columns: a feature split over several columns counts once."""
    joint = {k: c for k, c in features.factors.items() if len(c) > 1}
    inside = {i for c in joint.values() for i in c}
    single = {column.key: (i,) for i, column in enumerate(features.columns) if i not in inside}
    return {**single, **joint}


def factor_values(problem: SequencingProblem, values: Array) -> Array:
    """(..., factors) from feature values (..., n + m)."""
    groups = factor_groups(problem.features)
    return np.stack([values[..., list(columns)].sum(axis=-1) for columns in groups.values()], axis=-1)


def sample_transitions(problem: SequencingProblem) -> Transitions:
    """Every possible next region at every step of a few random orders: early, middle and late steps weigh the same."""
    n, generator = problem.n, np.random.default_rng([SEED, problem.n])
    orders = np.array([generator.permutation(n) for _ in range(ORDERS)])
    done = _prefixes(orders)
    sets, region = np.nonzero(~done)
    values = factor_values(problem, problem.values(done))[sets, region]
    where = np.full(done.shape, -1, np.int64)
    where[sets, region] = np.arange(len(sets))
    steps = where[np.arange(len(done)), orders.ravel()].reshape(ORDERS, n)
    return Transitions(values, region, tuple(steps))


def sequence_values(problem: SequencingProblem, sequence: tuple[int, ...]) -> Array:
    """Factor values of each step, (N, factors)."""
    order = np.array([sequence])
    return factor_values(problem, problem.values(_prefixes(order)))[np.arange(problem.n), order[0]]


def spreads_of(values: Array) -> tuple[Spread, ...]:
    """Of values (T, factors), one per factor."""
    found = []
    for column in values.T:
        least, most = float(column.min()), float(column.max())
        counts = np.histogram(column, BINS, (least, most if most > least else least + 1.0))[0]
        found.append(Spread(least, most, tuple(int(c) for c in counts)))
    return tuple(found)


def measure_levels(keys: tuple[str, ...], values: Array, rules: LevelRules | None = None) -> Levels:
    """Two thresholds per factor from values (T, factors): terciles, thirds of the range, or what the expert says.

    Raises:
        UnknownFeature: A rule names a factor that isn't there.
        InvalidInput: An expert's lower threshold is above the upper one.

    Paper: thresholds are typed in by hand there. Terciles make each level equally common over the tools at hand, which is what an even
        spread is later tested against; a factor with many equal values (most steps touch a finished region) has fewer levels.
    """
    rules = rules or LevelRules()
    unknown = sorted({name for name, *_ in (*rules.chosen, *rules.expert)} - set(keys))
    if unknown:
        raise UnknownFeature(f"There is no feature '{unknown[0]}' to set levels of. Choose from: {', '.join(sorted(keys))}.")
    pairs = [_thresholds(key, values[:, k], rules) for k, key in enumerate(keys)]
    return Levels(keys, tuple(a for a, _ in pairs), tuple(b for _, b in pairs), tuple(rules.of(key) for key in keys))


def _thresholds(key: str, values: Array, rules: LevelRules) -> tuple[float, float]:
    rule, slack = rules.of(key), EVEN * float(np.ptp(values))
    if rule == "expert":
        low, high = next((a, b) for name, a, b in rules.expert if name == key)
        if not low <= high:
            raise InvalidInput(f"The lower threshold of '{key}' is {low:g}, above the upper one, {high:g}. Give the smaller one first.")
        return low, high
    if rule == "range":
        low, high = np.linspace(values.min(), values.max(), 4)[1:3]
    else:
        low, high = np.quantile(values, [1 / 3, 2 / 3])
    return float(low + slack), float(high + slack)


def _prefixes(orders: NDArray[np.int64]) -> NDArray[np.bool_]:
    """(orders * N, N) finished regions before each step."""
    count, n = orders.shape
    rank = np.empty_like(orders)
    rank[np.arange(count)[:, None], orders] = np.arange(n)
    return (rank[:, None, :] < np.arange(n)[None, :, None]).reshape(count * n, n)
