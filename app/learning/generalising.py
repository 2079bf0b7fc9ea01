"""From demonstrations to a policy for tools nobody has demonstrated, without asking anything.

The demonstrations of one expert on many tools rarely agree under one set of weights: nobody is that regular. A margin that has to
hold for all of them then bends the weights towards the exceptions. Likelihood lets an exception be unlikely instead. What is
decided by the demonstrations, and by nothing else: the weights, how strongly they are held near zero, and which feature set.
"""

import math
from dataclasses import dataclass, replace

import numpy as np

from app.errors import InvalidInput
from app.learning.certified import Certificate, certify
from app.learning.hits import judge
from app.learning.maximum_entropy import Lesson, SoftFit, fit, left_out_weights, lessons_of, surprise
from app.learning.performance_state import LearningDemonstration
from app.learning.policy import Policy
from app.learning.qp import Array
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
        demonstrations: On tools of at most 14 regions; two or more, otherwise nothing can be left out and the strongest penalty is kept.
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
    own = demonstrations[0].problem.features  # perhaps with features switched off or added
    known = {**FEATURE_SETS, own.name: own}
    for name in sets or (own.name, LAYOUT):
        shown = [replace(d, problem=on_features(d.problem, known[name])) for d in demonstrations]
        lessons, scale, live = lessons_of(shown)
        start = None
        for penalty in penalties if len(shown) > 1 else penalties[:1]:
            found = fit(lessons, penalty, start)
            start = found.weights
            tried.append((_tried(shown, lessons, found, np.array(live) / scale), found, scale, live))
    best, found, scale, live = max(tried, key=lambda t: t[0].merit)
    features = known[best.features]
    policy = Policy(found.weights / scale * np.array(live), features.name, features.version, (), None, live)
    return Generalised(policy, tuple(t for t, *_ in tried), scale, found)


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
    them to the letter makes no exceptions. None below `FEWEST` demonstrations, and on tools that are too large for likelihood.
    """
    if len(demonstrations) < FEWEST or any(d.problem.n > TENSOR_LIMIT for d in demonstrations):
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


def _tried(shown: list[LearningDemonstration], lessons: list[Lesson], found: SoftFit, unit: Array) -> Trial:
    """How well each demonstration is predicted without it."""
    without = left_out_weights(lessons, found) if len(lessons) > 1 else [found.weights]
    held_out = [surprise(lesson, w)[0] for lesson, w in zip(lessons, without, strict=True)]
    judged = [judge(d.problem, w * unit, d.sequence) for d, w in zip(shown, without, strict=True)]
    return Trial(
        shown[0].problem.features.name,
        found.penalty,
        found.surprise,
        float(np.mean(held_out)),
        sum(j.hit for j in judged),
        float(np.mean([j.tau for j in judged])),
    )


def on_features(problem: SequencingProblem, features: FeatureSet) -> SequencingProblem:
    """The same tool under another feature set, without interactions; the very same problem when it has them already."""
    if problem.features.name == features.name and not problem.interactions:
        return problem
    return SequencingProblem(problem.graph, features, ())
