"""Fig. 4: what each term of Eq. 7 does, seen by leaving it out. Nobody answers anything; only subgradient steps are watched."""

from dataclasses import dataclass, replace

import numpy as np

from app.learning.loss import LossTerms, performance_gradient
from app.learning.performance_state import LearningDemonstration, PerformanceParameters
from app.learning.qp import Array
from app.learning.sampling import POOL, diverse_sample, feature_scale, feature_sums, random_pool
from app.sequencing.shortest import shortest_sequence

VARIANTS = ("all terms", "no alpha", "no beta", "no gamma")
UPDATES = 60
BAND = 1.96  # standard errors: 95 %
BALANCED = PerformanceParameters(alpha=1.0, beta=1.0, gamma=1.0, regularisation=0.1, learning_rate=0.05, floor=0.01)


@dataclass(frozen=True)
class Trace:
    """What happened along the updates of one run; entry 0 is the random start."""

    spread: Array  # (U + 1,) deviation of the samples' costs within a tool, per |w|
    shift: Array  # (U + 1,) how far the cheapest sample's features move at this update, mean over tools
    violations: Array  # (U + 1,) demonstrations that are not the cheapest within the tolerance


@dataclass(frozen=True)
class Band:
    """Mean over seeds and its 95 % confidence interval, per update."""

    mean: Array
    low: Array
    high: Array


@dataclass(frozen=True)
class Ablation:
    """Fig. 4 in numbers: variant -> quantity -> band."""

    seeds: int
    updates: int
    tools: int
    bands: dict[str, dict[str, Band]]


@dataclass(frozen=True)
class _Start:
    """One seed's samples and first weights, the same for every variant."""

    scale: Array
    live: tuple[bool, ...]
    demo: Array
    samples: list[Array]
    first: Array


def ablate(
    demonstrations: list[LearningDemonstration], seeds: int = 20, updates: int = UPDATES, parameters: PerformanceParameters = BALANCED
) -> Ablation:
    """Run every variant from the same samples and first weights, once per seed.

    Args:
        demonstrations: Tools with the expert's sequences.
        seeds: Number of runs of each variant.
        updates: Subgradient steps per run.
        parameters: Hyperparameters; the factor of the term in question is set to 0.

    Paper: the factors behind Fig. 4 and its number of runs are not published. The three terms weigh alike here, so that each can be seen
        (the product's defaults make gamma an exact penalty, beside which the others vanish), and the samples do not grow by answers.
    """
    variants = {
        "all terms": parameters.terms,
        "no alpha": replace(parameters.terms, alpha=0.0),
        "no beta": replace(parameters.terms, beta=0.0),
        "no gamma": replace(parameters.terms, gamma=0.0),
    }
    starts = [_start(demonstrations, parameters, seed) for seed in range(seeds)]
    traces = {name: [_run(demonstrations, start, terms, parameters, updates) for start in starts] for name, terms in variants.items()}
    quantities = ("spread", "shift", "violations")
    bands = {name: {q: band(np.array([getattr(t, q) for t in found])) for q in quantities} for name, found in traces.items()}
    return Ablation(seeds, updates, len(demonstrations), bands)


def band(runs: Array) -> Band:
    """Mean and 95 % confidence interval over the first axis of (seeds, updates)."""
    mean = runs.mean(axis=0)
    half = BAND * runs.std(axis=0, ddof=1) / np.sqrt(len(runs)) if len(runs) > 1 else np.zeros_like(mean)
    return Band(mean, mean - half, mean + half)


def _start(demonstrations: list[LearningDemonstration], parameters: PerformanceParameters, seed: int) -> _Start:
    generator = np.random.default_rng(seed)
    sums = [feature_sums(d.problem, random_pool(d.problem, POOL, generator)) for d in demonstrations]
    scale, live = feature_scale(sums)
    demo = np.array([d.problem.feature_sum(d.sequence) for d in demonstrations]) / scale
    blocks = [block / scale for block in sums]
    samples = [b[diverse_sample(phi, b, parameters.samples, parameters.zeta)] for phi, b in zip(demo, blocks, strict=True)]
    first = np.where(live, generator.uniform(parameters.floor, 1.0, len(scale)), 0.0)
    return _Start(scale, live, demo, samples, first)


def _run(
    demonstrations: list[LearningDemonstration], start: _Start, terms: LossTerms, parameters: PerformanceParameters, updates: int
) -> Trace:
    floor = np.where(start.live, parameters.floor, 0.0)
    w, before = start.first, _nearest(start, start.first)
    rows: list[tuple[float, float, float]] = []
    for step in range(updates + 1):
        best = (
            np.array([d.problem.feature_sum(shortest_sequence(d.problem, w / start.scale).sequence) for d in demonstrations]) / start.scale
        )
        now = _nearest(start, w)
        gap = (start.demo - best) @ w / np.maximum(np.abs(best @ w), 1e-12)
        spread = np.mean([(x @ w).std() for x in start.samples]) / np.linalg.norm(w)
        rows.append((float(spread), float(np.linalg.norm(now - before, axis=1).mean()), float((gap > parameters.tolerance).sum())))
        rate = parameters.learning_rate / (1 + 2 * terms.regularisation * parameters.learning_rate * step)
        gradient = np.where(start.live, performance_gradient(w, start.demo, start.samples, best, terms), 0.0)
        w, before = np.maximum(w - rate * gradient, floor), now
    return Trace(*np.array(rows).T)


def _nearest(start: _Start, w: Array) -> Array:
    """Feature sum of each tool's cheapest sample, (d, n + m)."""
    return np.array([x[int(np.argmin(x @ w))] for x in start.samples])
