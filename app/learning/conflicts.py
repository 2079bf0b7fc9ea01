"""Why no weights explain all demonstrations: minimal sets that contradict each other, and what would resolve each.

A set is minimal when leaving out any one of its demonstrations leaves the rest explainable (deletion filter). One set
explains one contradiction; the search goes on without its worst member until the rest fits.
"""

from collections.abc import Sequence as Ordered
from dataclasses import dataclass, replace

import numpy as np

from app.learning.certified import CertifiedPrior, compromise, excess, explore, is_hit, pool_for
from app.learning.cuts import CutPool
from app.learning.performance_state import LearningDemonstration
from app.sequencing.features import Interaction, interaction_label
from app.sequencing.problem import SequencingProblem

QUICK = 8  # samples when only a yes or no is asked for
NEGLIGIBLE = 1e-9


@dataclass(frozen=True)
class Conflict:
    """Demonstrations of which not all can be cheapest sequences under the same weights."""

    members: tuple[int, ...]
    slack: tuple[float, ...]  # per member: relative extra cost it has when the others are explained
    resolved_by_sign: tuple[int, ...]  # columns whose weight would have to be allowed below 0, each alone enough
    resolved_by_interaction: tuple[Interaction, ...]  # products of two features, each alone enough


def realisable(pool: CutPool, members: Ordered[int], prior: CertifiedPrior) -> bool:
    """Whether some weights make each of the demonstrations a cheapest sequence that few others share."""
    found = explore(pool, members, replace(prior, samples=QUICK), np.random.default_rng(0))
    if found.cone.empty or not len(found.samples):
        return False
    weights = pool.frame.weights(found.centre)
    return all(is_hit(pool.demonstrations[i], weights) for i in members)


def minimal_conflict(pool: CutPool, members: Ordered[int], prior: CertifiedPrior) -> tuple[int, ...]:
    """A subset that can't be explained although each part of it can; empty when all fit together."""
    if realisable(pool, members, prior):
        return ()
    kept = list(members)
    for i in list(members):
        rest = [k for k in kept if k != i]
        if rest and not realisable(pool, rest, prior):
            kept = rest
    return tuple(kept)


def conflicts(
    demonstrations: Ordered[LearningDemonstration],
    prior: CertifiedPrior | None = None,
    of_interest: Ordered[SequencingProblem] = (),
    suspects: Ordered[Interaction] = (),
) -> tuple[Conflict, ...]:
    """Minimal contradicting sets until the rest fits; empty when all demonstrations are realisable together.

    Args:
        demonstrations: Tools with the expert's sequences.
        prior: Declared signs and assumptions.
        of_interest: Other tools, which decide with these what can be told apart.
        suspects: Interactions that might be missing; each is tried alone on each set.
    """
    prior = prior or CertifiedPrior()
    pool = pool_for(demonstrations, prior, of_interest)
    left, found = list(range(len(demonstrations))), []
    while left and (members := minimal_conflict(pool, left, prior)):
        slack = slack_of(pool, members, prior)
        found.append(
            Conflict(members, slack, _signs(demonstrations, members, prior), _interactions(demonstrations, members, prior, suspects))
        )
        left.remove(members[int(np.argmin(slack))])  # the one that is nearest to fitting goes, so that the next set is another one
    return tuple(found)


def slack_of(pool: CutPool, members: Ordered[int], prior: CertifiedPrior) -> tuple[float, ...]:
    """Per member, how much above the cheapest it is, relatively, when the weights explain the other members.

    Of all weights that do, those nearest to explaining it too are not searched for: this is the centre's figure.
    """
    found = []
    for i in members:
        others = [k for k in members if k != i]
        space = explore(pool, others, replace(prior, samples=QUICK), np.random.default_rng(0)) if others else None
        if space is None or not len(space.samples):
            u = compromise(pool, members, prior)
            found.append(excess(pool.demonstrations[i], pool, u))
        else:
            found.append(min(excess(pool.demonstrations[i], pool, u) for u in (space.centre, *space.samples)))
    return tuple(found)


def _signs(demonstrations: Ordered[LearningDemonstration], members: tuple[int, ...], prior: CertifiedPrior) -> tuple[int, ...]:
    mine = [demonstrations[i] for i in members]
    width = len(mine[0].problem.columns)
    signs = list(prior.signs or (1,) * width)
    found = []
    for k in range(width):
        if signs[k] == 0:
            continue
        freed = replace(prior, signs=tuple(0 if j == k else s for j, s in enumerate(signs)))
        if realisable(pool_for(mine, freed, ()), range(len(mine)), freed):
            found.append(k)
    return tuple(found)


def _interactions(
    demonstrations: Ordered[LearningDemonstration], members: tuple[int, ...], prior: CertifiedPrior, suspects: Ordered[Interaction]
) -> tuple[Interaction, ...]:
    found = []
    for extra in suspects:
        first = demonstrations[members[0]].problem
        if extra in first.interactions:
            continue
        mine = [LearningDemonstration(with_interaction(demonstrations[i].problem, extra), demonstrations[i].sequence) for i in members]
        wider = replace(prior, signs=None if prior.signs is None else (*prior.signs, 1))
        if realisable(pool_for(mine, wider, ()), range(len(mine)), wider):
            found.append(extra)
    return tuple(found)


def with_interaction(problem: SequencingProblem, extra: Interaction) -> SequencingProblem:
    """The same tool with one more product of features."""
    return replace(problem, interactions=(*problem.interactions, extra))


def conflict_words(found: Conflict, names: Ordered[str], problem: SequencingProblem) -> str:
    """One sentence for the expert: which tools, how much, and what would resolve it."""
    listed = [f"{names[i]} ({100 * s:.2g} %)" for i, s in zip(found.members, found.slack, strict=True)]
    who = listed[0] if len(listed) == 1 else f"{', '.join(listed[:-1])} and {listed[-1]}"
    text = f"{who} can't all be the best order; in brackets, how much dearer each is when the others are explained."
    ways = [f"the weight of “{problem.columns[k].label.lower()}” could be negative" for k in found.resolved_by_sign]
    ways += [f"{interaction_label(i, problem.features)} counted together" for i in found.resolved_by_interaction]
    return f"{text} It would be resolved if {' or if '.join(ways)}." if ways else text
