"""Which products of features count: selected, not assumed.

A product of two features explains more and proves less: with all pairs of ten features 18 orders fit exactly, whatever they are.
So a suspected product is kept only when certified weights learned with it predict more of the recorded orders, each left out of
learning in turn, than without it. Products are added one at a time, the most telling first; each fit contains the one before.
"""

from collections.abc import Callable
from collections.abc import Sequence as Ordered
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from app.learning.certified import CertifiedPrior, compromise, explore, is_hit, pool_for
from app.learning.hits import judge
from app.learning.performance_state import LearningDemonstration
from app.sequencing.features import Interaction, interaction_label
from app.sequencing.problem import TENSOR_LIMIT

FEWEST = 4  # recorded orders from which leaving one out says something
MORE = 1  # orders that a product has to predict beyond those predicted without it
SAMPLES = 24  # of the weights of one fit; the mean direction is what predicts

Tell = Callable[[float, str], None]  # share done, what is done


@dataclass(frozen=True)
class Held:
    """Recorded orders predicted by weights learned without them."""

    hits: int
    tau: float  # mean Kendall tau of the predictions


@dataclass(frozen=True)
class InteractionTrial:
    """What came of a suspected product."""

    interaction: Interaction
    kept: bool
    without: Held | None  # before it was added; None: not tested
    with_it: Held | None


@dataclass(frozen=True)
class Selection:
    """The products that count, and why."""

    kept: tuple[Interaction, ...]
    trials: tuple[InteractionTrial, ...]  # one per suspected product, in the order given
    orders: int  # recorded orders it was tested on
    untested: str  # why nothing was tested, empty when it was

    def words(self, demonstration: LearningDemonstration) -> tuple[str, ...]:
        """A sentence per suspected product."""
        return tuple(_sentence(t, interaction_label(t.interaction, demonstration.problem.features), self) for t in self.trials)

    def to_json(self, demonstration: LearningDemonstration) -> list[dict[str, Any]]:
        """Plain JSON values."""
        return [
            {
                "first": t.interaction.first,
                "second": t.interaction.second,
                "kept": t.kept,
                "tested": t.with_it is not None,
                "without": vars(t.without) if t.without else None,
                "with": vars(t.with_it) if t.with_it else None,
                "of": self.orders,
                "words": sentence,
            }
            for t, sentence in zip(self.trials, self.words(demonstration), strict=True)
        ]


def select_interactions(
    demonstrations: Ordered[LearningDemonstration], suspects: Ordered[Interaction], seed: int = 0, tell: Tell = lambda share, words: None
) -> Selection:
    """Test suspected products of features by leaving each recorded order out in turn.

    Args:
        demonstrations: Tools with the expert's sequences; interactions they have already don't matter.
        suspects: Products that might count.
        seed: Of the fits.
        tell: Called before each fit.

    Returns:
        The products that predict more orders. With fewer than `FEWEST` orders, or tools of more than 14 regions, nothing can be tested
        (or not in reasonable time): then all suspected ones count, and it is said.
    """
    untested = _why_untested(demonstrations)
    if untested or not suspects:
        trials = tuple(InteractionTrial(s, True, None, None) for s in suspects)
        return Selection(tuple(suspects), trials, len(demonstrations), untested)
    most, done = 1 + len(suspects) * (len(suspects) + 1) // 2, 0

    def held(interactions: tuple[Interaction, ...]) -> Held:
        nonlocal done
        tell(done / most, "Testing which features act together")
        done += 1
        return left_out(demonstrations, interactions, seed)

    kept: tuple[Interaction, ...] = ()
    best, open_ones = held(()), list(suspects)
    found: dict[Interaction, InteractionTrial] = {}
    while open_ones:
        tried = {s: held((*kept, s)) for s in open_ones}
        winner = max(tried, key=lambda s: (tried[s].hits, tried[s].tau))
        for s, value in tried.items():
            found[s] = InteractionTrial(s, False, best, value)
        if tried[winner].hits < best.hits + MORE:
            break
        found[winner] = replace(found[winner], kept=True)
        kept, best = (*kept, winner), tried[winner]
        open_ones.remove(winner)
    return Selection(tuple(s for s in suspects if s in kept), tuple(found[s] for s in suspects), len(demonstrations), "")


def left_out(demonstrations: Ordered[LearningDemonstration], interactions: tuple[Interaction, ...], seed: int = 0) -> Held:
    """How many recorded orders certified weights predict that were learned without them."""
    shown = [replace(d, problem=replace(d.problem, interactions=interactions)) for d in demonstrations]
    prior, everyone = CertifiedPrior(samples=SAMPLES), range(len(shown))
    pool = pool_for(shown, prior, ())  # its cuts serve every fit
    judged = []
    for i, d in enumerate(shown):
        others = [k for k in everyone if k != i]
        explored = explore(pool, others, prior, np.random.default_rng([seed, i]))
        weights = pool.frame.weights(explored.centre)
        if explored.cone.empty or not all(is_hit(shown[k], weights) for k in others):
            weights = pool.frame.weights(compromise(pool, others, prior))
        judged.append(judge(d.problem, weights, d.sequence))
    return Held(sum(j.hit for j in judged), sum(j.tau for j in judged) / len(judged))


def _why_untested(demonstrations: Ordered[LearningDemonstration]) -> str:
    if len(demonstrations) < FEWEST:
        return f"it takes {FEWEST} recorded orders to test it"
    if any(d.problem.n > TENSOR_LIMIT for d in demonstrations):
        return f"tools of more than {TENSOR_LIMIT} regions take too long to test it"
    return ""


def _sentence(trial: InteractionTrial, label: str, selection: Selection) -> str:
    name = f"{label[0].upper()}{label[1:]}"
    if trial.without is None or trial.with_it is None:
        return f"{name} together: counted as you suspect; {selection.untested}."
    more = trial.with_it.hits - trial.without.hits
    orders = f"{abs(more)} {'order' if abs(more) == 1 else 'orders'}"
    now, before, of = trial.with_it.hits, trial.without.hits, selection.orders
    if trial.kept:
        return f"{name} together: kept, because it predicts {orders} more ({now} of {of} instead of {before})."
    said = "it predicts no order more" if more == 0 else f"it predicts {orders} {'more' if more > 0 else 'fewer'}"
    return f"{name} together: left out, because {said} ({now} of {of} with it, {before} without)."
