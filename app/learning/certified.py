"""Certified learning: weights under which every demonstration is a cheapest sequence, proved, or the reason why there are none.

Max-margin learning by constraint generation: solve over the alternatives met so far, ask the exact oracle for a cheaper one
on every demonstrated tool, repeat until there is none. What the demonstrations leave open stays visible as samples of the
version space.

Paper:
    Eq. 7 is a penalty that a gradient method lowers; here "no sequence is cheaper" holds exactly, and where it can't, each
        demonstration gets as little slack as it needs and the ones that contradict each other are named (`conflicts`).
    The prior is stated: within what is known every direction of the weights is as likely as any other, in units of each feature's
        spread over random sequences. The weights are the mean direction.
"""

from collections.abc import Sequence as Ordered
from dataclasses import dataclass

import numpy as np

from app.errors import EmptySample, InvalidInput
from app.learning.cuts import Cut, CutPool, unit_rows
from app.learning.identifiable import Frame
from app.learning.many_optima import cheapest_orders, random_orders, sums_of
from app.learning.performance_state import LearningDemonstration
from app.learning.qp import Array, QuadraticProgram, solve
from app.learning.version_space import Cone, cone_of, sample
from app.sequencing.classes import class_size, omega_size
from app.sequencing.problem import SequencingProblem, check_sequence

FEW = 8  # samples while cuts are still being found
ROUNDS = 80  # of constraint generation
HIT_SIZE = 64  # equally cheap sequences beyond which "the cheapest" means nothing, unless all are equivalent
VARIES = 1e-9  # spread of a feature sum, in its unit, under which a tool says nothing about it
CREDIBLE = (0.05, 0.95)
QP_CUTS = 60  # rounds of constraint generation for the compromise


@dataclass(frozen=True)
class CertifiedPrior:
    """What is assumed beside the demonstrations."""

    signs: tuple[int, ...] | None = None  # per column 1: weight at least 0, -1: at most 0, 0: either; None: all at least 0
    samples: int = 64  # of the version space
    margin: float = 0.02  # compromise: how much dearer an alternative should be, per unit of its difference
    least: float = 0.01  # compromise: smallest share of a signed coordinate, 1 = as much as the average one
    regularisation: float = 0.05  # compromise: lambda


@dataclass(frozen=True)
class Explored:
    """The weights that agree with some demonstrations and rows."""

    cone: Cone
    samples: Array  # (s, r) directions of length 1, each checked against the exact oracle; none when empty
    members: tuple[int, ...]  # demonstrations they explain
    rounds: int

    @property
    def centre(self) -> Array:
        """(r,) mean direction; zeros when empty."""
        return mean_direction(self.samples) if len(self.samples) else np.zeros(len(self.cone.signed))


@dataclass(frozen=True)
class Certificate:
    """What is proved about a set of demonstrations, and the weights."""

    weights: Array  # (k,) on the features as they are
    coordinates: Array  # (r,) the same in reduced coordinates
    frame: Frame
    realisable: bool  # under the weights every demonstration is a cheapest sequence, and few others are
    margin: float  # smallest relative extra cost of the best alternative met that is no forced tie; 0 when not realisable
    slack: Array  # (d,) how much each demonstration costs above the cheapest of its tool, relative; 0 when realisable
    class_sizes: tuple[int, ...]  # (d,) cheapest sequences of each tool; empty when not counted
    forced: int  # dimensions of the weights that equalities fix
    identifiable: tuple[bool, ...]  # (k,) False: no demonstrated tool says anything about this weight
    intervals: Array  # (k, 2) 5 % and 95 % of each weight's share (they add up to 1) over the samples
    samples: Array  # (s, k) weights that explain all demonstrations; none when not realisable
    cuts: tuple[Cut, ...]
    oracle_calls: int
    rounds: int


def certify(
    demonstrations: Ordered[LearningDemonstration],
    prior: CertifiedPrior | None = None,
    of_interest: Ordered[SequencingProblem] = (),
    seed: int = 0,
) -> Certificate:
    """Learn from demonstrations alone.

    Args:
        demonstrations: Tools with the expert's sequences.
        prior: What is assumed beside them.
        of_interest: Other tools the weights are meant for; they decide, with the demonstrated ones, what can be told apart.
        seed: Of the samples.

    Returns:
        Weights that make every demonstration a cheapest sequence if there are any, else those of least slack.

    Raises:
        EmptySample: No demonstration, or all sequences of all tools have the same features.
        InvalidInput: The tools have different features.
        IncompleteSequence: A demonstration misses or repeats regions.
    """
    prior = prior or CertifiedPrior()
    pool = pool_for(demonstrations, prior, of_interest)
    everyone = range(len(demonstrations))
    explored = explore(pool, everyone, prior, np.random.default_rng(seed))
    if explored.cone.empty or not all(is_hit(d, pool.frame.weights(explored.centre)) for d in demonstrations):
        return certificate(pool, compromise(pool, everyone, prior), explored, realisable=False)
    return certificate(pool, explored.centre, explored, realisable=True)


def pool_for(demonstrations: Ordered[LearningDemonstration], prior: CertifiedPrior, of_interest: Ordered[SequencingProblem]) -> CutPool:
    """An empty pool of cuts in the coordinates of all tools."""
    if not demonstrations:
        raise EmptySample("There is nothing to learn from: record at least one demonstration.")
    problems = [d.problem for d in demonstrations] + list(of_interest)
    if len({p.columns for p in problems}) > 1:
        raise InvalidInput("The tools of one run need the same features and interactions; keep tools of another kind in their own project.")
    for d in demonstrations:
        check_sequence(d.sequence, d.problem.n)
    frame = Frame.of(problems, prior.signs)
    if not frame.size:
        raise EmptySample(
            "All orders of these tools have the same features, so none can be preferred. Demonstrate a tool with more regions."
        )
    return CutPool(frame, list(demonstrations))


def explore(
    pool: CutPool,
    members: Ordered[int],
    prior: CertifiedPrior,
    generator: np.random.Generator,
    rows: Array | None = None,
    known: Explored | None = None,
) -> Explored:
    """Find the cuts of some demonstrations until the samples of what is left all pass the oracle.

    Args:
        pool: Holds the demonstrations; gets the cuts.
        members: The demonstrations that count.
        prior: Assumptions.
        generator: For the samples.
        rows: (m, r) of length 1, what answers say beside: rows . u >= 0.
        known: What was found for a part of the members and rows; the rest is added to it.

    Returns:
        The version space; empty when no weights agree.
    """
    extra = np.zeros((0, pool.frame.size)) if rows is None else rows
    taken = len(pool.cuts)
    mine = set(members)
    fresh = np.vstack([unit_rows([c.difference for c in pool.cuts if c.owner in mine], pool.frame.size), extra])
    if known is None:
        cone = cone_of(fresh, pool.frame.signed)
        trials = np.vstack([_unit(pool.frame.signed), sample(cone, FEW, generator)])
    else:
        cone = known.cone.with_rows(fresh, known.samples)
        trials = sample(cone, FEW, generator)
    settled = set() if known is None else {i for i in members if i in known.members}  # checked on a larger space before
    count, rounds = FEW, 0
    while not cone.empty and rounds < ROUNDS:
        rounds += 1
        fine = pool.separate(trials, [i for i in members if i not in settled])
        if fine.all():
            fine &= pool.separate(trials, sorted(settled))
        new = unit_rows([c.difference for c in pool.cuts[taken:] if c.owner in mine], pool.frame.size)
        taken = len(pool.cuts)
        if fine.all() and count == prior.samples and rounds > 1:
            return Explored(cone, trials[1:], tuple(members), rounds)
        if fine.all() and rounds > 1:
            count = prior.samples
        cone = cone.with_rows(new, trials[fine])
        drawn = sample(cone, count, generator)
        trials = np.vstack([mean_direction(drawn), drawn]) if len(drawn) else drawn
    return Explored(cone, trials[1:] if not cone.empty else np.zeros((0, pool.frame.size)), tuple(members), rounds)


def compromise(pool: CutPool, members: Ordered[int], prior: CertifiedPrior) -> Array:
    """Weights of least slack, for demonstrations that contradict each other, as coordinates of length 1.

    min lambda/2 |u|^2 + sum of slack over demonstrations, difference . u >= margin |difference| - slack, signed coordinates at least
    `least` and 1 on average; alternatives are added until the oracle knows no worse one.

    Paper: a least weight is needed: with one feature on which all demonstrations tie, no slack at all explains anything.
    """
    frame, members = pool.frame, list(members)
    u = frame.signed + 1e-3 * (1 - frame.signed)
    for attempt in range(QP_CUTS):
        before = len(pool.cuts)
        pool.separate(_unit(u)[None], members)
        if attempt and len(pool.cuts) == before:
            break
        u = _least_slack(pool.of(members), members, frame.signed, prior)
    return _unit(u)


def _least_slack(cuts: list[Cut], members: list[int], signed: Array, prior: CertifiedPrior) -> Array:
    r, d, m = len(signed), len(members), len(cuts)
    place = {i: q for q, i in enumerate(members)}
    rows = np.zeros((m + d + r + 2, r + d))
    limits = np.zeros(len(rows))
    for k, cut in enumerate(cuts):
        rows[k, :r], rows[k, r + place[cut.owner]] = -cut.difference, -1.0
        limits[k] = -prior.margin * float(np.linalg.norm(cut.difference))
    rows[m : m + d, r:] = -np.eye(d)
    rows[m + d : m + d + r, :r] = -np.diag(signed)
    limits[m + d : m + d + r] = -prior.least * signed
    if signed.any():
        rows[-2, :r], rows[-1, :r] = signed, -signed
        limits[-2], limits[-1] = signed.sum(), -signed.sum()
    program = QuadraticProgram(np.r_[np.full(r, prior.regularisation), np.zeros(d)], np.r_[np.zeros(r), np.ones(d)], rows, limits)
    return solve(program)[:r]


def certificate(pool: CutPool, u: Array, explored: Explored, realisable: bool, count_ties: bool = True) -> Certificate:
    """What is known, with weights u (r,); counting the ties of each tool takes the longest."""
    frame, demonstrations = pool.frame, pool.demonstrations
    weights = frame.weights(u)
    drawn = frame.weights_of(explored.samples if realisable else explored.samples[:0])
    return Certificate(
        weights=weights,
        coordinates=u,
        frame=frame,
        realisable=realisable,
        margin=_margin(pool, weights, u) if realisable else 0.0,
        slack=np.zeros(len(demonstrations)) if realisable else np.array([excess(d, pool, u) for d in demonstrations]),
        class_sizes=tuple(class_size(d.problem, weights) for d in demonstrations) if count_ties else (),
        forced=frame.size - explored.cone.basis.shape[1],
        identifiable=identifiable(frame, [d.problem for d in demonstrations]),
        intervals=_intervals(drawn if len(drawn) else weights[None], frame),
        samples=drawn,
        cuts=tuple(pool.cuts),
        oracle_calls=pool.oracle_calls,
        rounds=explored.rounds,
    )


def excess(demonstration: LearningDemonstration, pool: CutPool, u: Array) -> float:
    """How much more a demonstration costs than the cheapest sequence of its tool, relative to its cost."""
    problem, weights = demonstration.problem, pool.frame.weights(u)
    own = problem.feature_sum(demonstration.sequence)
    best = sums_of(problem, cheapest_orders(problem, weights[None]))[0]
    return max(0.0, float((own - best) @ weights)) / max(float(np.abs(weights) @ np.abs(own)), 1e-300)


def is_hit(demonstration: LearningDemonstration, weights: Array) -> bool:
    """Whether the demonstration is in the lowest cost class and that class means something (few members, or equivalents only)."""
    size = class_size(demonstration.problem, weights)
    if size <= HIT_SIZE:
        return True
    members, all_of_them = omega_size(demonstration.problem, demonstration.sequence)
    return all_of_them and members == size


def identifiable(frame: Frame, problems: Ordered[SequencingProblem]) -> tuple[bool, ...]:
    """(k,) whether some of the tools has orders that differ in a column."""
    generator = np.random.default_rng(1)
    found = np.zeros(len(frame.scale), np.bool_)
    for problem in problems:
        sums = sums_of(problem, random_orders(problem, 30, generator)) / frame.scale
        found |= np.ptp(sums, axis=0) > VARIES * np.maximum(1.0, np.abs(sums).max(axis=0))
    return tuple(bool(x) for x in found)


def mean_direction(samples: Array) -> Array:
    """(r,) of length 1."""
    return _unit(samples.mean(axis=0))


def _margin(pool: CutPool, weights: Array, u: Array) -> float:
    """Relative extra cost of the nearest alternative that is dearer at all."""
    sizes = [max(float(np.abs(weights) @ np.abs(d.problem.feature_sum(d.sequence))), 1e-300) for d in pool.demonstrations]
    extra = (float(cut.difference @ u) / sizes[cut.owner] for cut in pool.cuts)
    return min((x for x in extra if x > 1e-9), default=0.0)


def _intervals(weights: Array, frame: Frame) -> Array:
    shares = weights * frame.scale
    shares = shares / np.maximum(np.abs(shares).sum(axis=1, keepdims=True), 1e-300)
    return np.quantile(shares, CREDIBLE, axis=0).T


def _unit(u: Array) -> Array:
    size = float(np.linalg.norm(u))
    return u / size if size > 0 else np.ones_like(u) / np.sqrt(max(len(u), 1))
