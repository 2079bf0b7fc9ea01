"""From demonstrations to a policy for tools nobody has demonstrated, without asking anything.

The demonstrations of one expert on many tools rarely agree under one set of weights: nobody is that regular. A margin that has to
hold for all of them then bends the weights towards the exceptions. Likelihood lets an exception be unlikely instead. What is
decided by the demonstrations, and by nothing else: the weights, how strongly they are held near zero, and which feature set.
"""

import math
from collections.abc import Sequence as Ordered
from dataclasses import dataclass, replace

import numpy as np

from app.errors import InvalidInput
from app.learning.certified import Certificate, certify
from app.learning.hits import HIT_SIZE, judge
from app.learning.maximum_entropy import (
    AnyLesson,
    ListedLesson,
    SoftFit,
    fit,
    in_part,
    left_out_weights,
    lessons_of,
    listed,
    settled,
    surprise,
    unit_of,
)
from app.learning.performance_state import LearningDemonstration
from app.learning.policy import Policy
from app.learning.qp import Array
from app.learning.soft_graph import SAME, cheapest_in
from app.sequencing.comparison import kendall_tau
from app.sequencing.features import FEATURE_SETS, FeatureSet
from app.sequencing.problem import TENSOR_LIMIT, SequencingProblem

FEWEST = 4  # demonstrations from which leaving one out says something
CLEARLY = 0.3  # of the demonstrations
PENALTIES = (0.3, 0.1, 0.03, 0.01)  # strongest first: each fit starts from the one before
LAYOUT = "layout"


@dataclass(frozen=True)
class Trial:
    """One feature set and penalty, as tried."""

    features: str
    penalty: float
    surprise: float  # mean -log p of the demonstrations
    held_out: float  # the same, each demonstration left out in turn
    hits: int  # demonstrations predicted by the weights learned without them
    tau: float  # mean Kendall tau of these predictions

    @property
    def merit(self) -> tuple[int, float, float]:
        """Larger is better."""
        return self.hits, self.tau, -self.held_out


@dataclass(frozen=True)
class Generalised:
    """A learned policy and what it was chosen from."""

    policy: Policy
    trials: tuple[Trial, ...]
    scale: Array  # (F,) unit of each feature: the weights on scaled features are weights * scale
    fit: SoftFit  # on scaled features
    approximate: tuple[int, ...] = ()  # demonstrations whose likelihood counts part of the orders only

    @property
    def chosen(self) -> Trial:
        return max(self.trials, key=lambda t: t.merit)


def learn_generalising(
    demonstrations: list[LearningDemonstration], sets: tuple[str, ...] | None = None, penalties: tuple[float, ...] = PENALTIES
) -> Generalised:
    """The feature set, penalty and weights that best predict demonstrations left out of learning.

    Each demonstration is left out in turn and predicted with the weights learned without it (one Newton step from the joint ones):
    most hits, then the highest mean tau, then the least surprise decide. Likelihood alone would favour features that betray the order
    in which a table lists mirrored regions, which the expert's order follows but no one would call a policy.

    Args:
        demonstrations: Two or more, otherwise nothing can be left out and the strongest penalty is kept. Above 14 regions features and
            penalty are chosen with part of the orders; the weights are then learned with all of them up to 20 regions.
        sets: Names of the feature sets to choose from; the tools' own and "layout" if None.
        penalties: To choose from, strongest first.

    Returns:
        The policy. Its feature set may differ from the tools' own: use `on_features` for a tool's problem under it.

    Raises:
        InvalidInput: No demonstrations, or a tool has too many regions.
    """
    if not demonstrations:
        raise InvalidInput("Learning needs at least one demonstration.")
    tried: list[tuple[Trial, SoftFit, Array, tuple[bool, ...]]] = []
    taught: dict[str, tuple[list[LearningDemonstration], list[AnyLesson]]] = {}
    own = demonstrations[0].problem.features  # perhaps with features switched off or added
    known = {**FEATURE_SETS, own.name: own}
    for name in sets or (own.name, LAYOUT):
        shown = [replace(d, problem=on_features(d.problem, known[name])) for d in demonstrations]
        lessons, scale, live = lessons_of(shown)
        lessons = settled(shown, lessons, unit_of(scale, live), penalties[0])
        taught[shown[0].problem.features.name] = shown, lessons
        start = None
        for penalty in penalties if len(shown) > 1 else penalties[:1]:
            found = fit(lessons, penalty, start)
            start = found.weights
            tried.append((_tried(shown, lessons, found, np.array(live) / scale), found, scale, live))
    best, found, scale, live = max(tried, key=lambda t: t[0].merit)
    shown, lessons = taught[best.features]
    whole = listed(shown, lessons, unit_of(scale, live))
    if in_part(whole) != in_part(lessons):
        found = fit(whole, best.penalty, found.weights)
    features = known[best.features]
    policy = Policy(found.weights / scale * np.array(live), features.name, features.version, (), None, live)
    return Generalised(policy, tuple(t for t, *_ in tried), scale, found, in_part(whole))


@dataclass(frozen=True)
class Unasked:
    """The product's choice without answers."""

    policy: Policy
    certificate: Certificate | None  # the demonstrations agree under one set of weights, proved; None: exceptions are allowed for
    generalised: Generalised | None  # then likelihood decides
    certified_hits: int | None  # demonstrations predicted by certified weights learned without them; None: they contradict each other


def learn_unasked(demonstrations: list[LearningDemonstration], seed: int = 0) -> Unasked:
    """Certified weights where the demonstrations agree exactly and predict each other, else the policy that best predicts those left out.

    An expert who follows the weights to the letter is predicted best by the weights that all demonstrations agree on; one who makes
    exceptions, by likelihood. Which kind it is, the demonstrations say themselves: a few orders can often be explained exactly by weights
    that predict nothing, so agreement alone isn't enough.

    Raises:
        EmptySample: No demonstration, or all orders have the same features.
        InvalidInput: The tools differ in their features, or one has too many regions for likelihood.
    """
    certificate = certify(demonstrations, seed=seed)
    found = exceptions_predict_better(demonstrations, seed) if certificate.realisable else None
    if certificate.realisable and found is None:
        first = demonstrations[0].problem
        policy = Policy(
            certificate.weights, first.features.name, first.features.version, first.interactions, None, certificate.identifiable
        )
        return Unasked(policy, certificate, None, None)
    if found is not None:
        return Unasked(found.generalised.policy, None, found.generalised, found.certified_hits)
    generalised = learn_generalising(demonstrations)
    return Unasked(generalised.policy, None, generalised, None)


@dataclass(frozen=True)
class Exceptions:
    """Why an expert whose orders agree exactly is better predicted by allowing for exceptions."""

    generalised: Generalised
    certified_hits: int  # demonstrations predicted by certified weights learned without them


def exceptions_predict_better(demonstrations: list[LearningDemonstration], seed: int = 0) -> Exceptions | None:
    """The likelihood's policy if it is on other features and, each demonstration left out in turn, predicts clearly more of them.

    Clearly is `CLEARLY` of the demonstrations, at least two. On the same features exact agreement decides: an expert who agrees with
    them to the letter makes no exceptions. None below `FEWEST` demonstrations, and above 14 regions: `why_untested` says so.
    """
    if len(demonstrations) < FEWEST or why_untested(demonstrations):
        return None
    generalised = learn_generalising(demonstrations)
    if generalised.chosen.features == demonstrations[0].problem.features.name:
        return None
    needed = generalised.chosen.hits - max(2, math.ceil(CLEARLY * len(demonstrations)))
    hits = 0
    for i, left_out in enumerate(demonstrations):
        if hits > needed:
            return None
        weights = certify([*demonstrations[:i], *demonstrations[i + 1 :]], seed=seed).weights
        hits += judge(left_out.problem, weights, left_out.sequence).hit
    return Exceptions(generalised, hits) if hits <= needed else None


def why_untested(demonstrations: Ordered[LearningDemonstration]) -> str:
    """Why `exceptions_predict_better` didn't look, in words; empty where it did, or where there are too few demonstrations."""
    large = max(d.problem.n for d in demonstrations)
    if len(demonstrations) < FEWEST or large <= TENSOR_LIMIT:
        return ""
    return (
        f"Whether allowing for exceptions would predict better was not tested: that takes too long on tools of more than {TENSOR_LIMIT} "
        f"regions, and one has {large}."
    )


def exactness(regions: Ordered[int], approximate: Ordered[int]) -> str:
    """In words, whether the likelihood counted all orders of tools of these sizes; empty where all are small.

    Args:
        regions: Per demonstration, of its tool.
        approximate: Demonstrations computed in part.
    """
    if max(regions) <= TENSOR_LIMIT:
        return ""
    if not approximate:
        return "All orders of every tool were counted."
    sizes = ", ".join(str(regions[k]) for k in approximate)
    return (
        f"On {len(approximate)} of {len(regions)} tools ({sizes} regions) only orders through the likeliest sets of finished regions were "
        "counted: an approximation."
    )


def _tried(shown: list[LearningDemonstration], lessons: list[AnyLesson], found: SoftFit, unit: Array) -> Trial:
    """How well each demonstration is predicted without it."""
    without = left_out_weights(lessons, found) if len(lessons) > 1 else [found.weights]
    held_out = [surprise(lesson, w)[0] for lesson, w in zip(lessons, without, strict=True)]
    judged = [_judged(d, t, w, unit) for d, t, w in zip(shown, lessons, without, strict=True)]
    return Trial(
        shown[0].problem.features.name,
        found.penalty,
        found.surprise,
        float(np.mean(held_out)),
        sum(hit for hit, _ in judged),
        float(np.mean([tau for _, tau in judged])),
    )


def _judged(shown: LearningDemonstration, lesson: AnyLesson, w: Array, unit: Array) -> tuple[bool, float]:
    """Hit and tau of a prediction; on listed transitions among the listed orders, ties counted among them too."""
    if isinstance(lesson, ListedLesson):
        order, cost, ties = cheapest_in(lesson.graph, w)
        near = float(w @ lesson.total) - cost <= SAME * (1 + abs(cost))
        return near and ties <= HIT_SIZE, kendall_tau(order, shown.sequence)
    found = judge(shown.problem, w * unit, shown.sequence)
    return found.hit, found.tau


def on_features(problem: SequencingProblem, features: FeatureSet) -> SequencingProblem:
    """The same tool under another feature set, without interactions; the very same problem when it has them already."""
    if problem.features.name == features.name and not problem.interactions:
        return problem
    return SequencingProblem(problem.graph, features, ())
