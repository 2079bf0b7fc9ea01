"""Demonstrations of several experts: learned apart, compared, and pooled where that is possible."""

from collections.abc import Mapping
from collections.abc import Sequence as Ordered
from dataclasses import dataclass

import numpy as np

from app.learning.certified import Certificate, CertifiedPrior, certify, pool_for
from app.learning.conflicts import minimal_conflict
from app.learning.many_optima import cheapest_orders
from app.learning.performance_state import LearningDemonstration
from app.learning.qp import Array
from app.learning.questions import Sequence
from app.sequencing.comparison import kendall_tau
from app.sequencing.problem import SequencingProblem


@dataclass(frozen=True)
class Disagreement:
    """A tool that two experts would do in different orders."""

    tool: int
    first: str
    second: str
    extra: float  # how much dearer the second one's order is to the first one, or the reverse, whichever is more; relative


@dataclass(frozen=True)
class ExpertComparison:
    """Experts side by side."""

    names: tuple[str, ...]
    certificates: tuple[Certificate, ...]  # each learned from that expert's demonstrations alone
    chosen: tuple[tuple[Sequence, ...], ...]  # per tool, the order each expert's weights choose
    likeness: Array  # (e, e) mean Kendall tau of the orders they choose for the tools
    disagreements: tuple[Disagreement, ...]  # the largest first
    pooled: Certificate  # learned from all demonstrations together
    clash: tuple[int, ...]  # why pooling fails: a smallest set, over all demonstrations in the order of `names`; empty when it works


def compare_experts(
    demonstrations: Mapping[str, Ordered[LearningDemonstration]],
    tools: Ordered[SequencingProblem],
    prior: CertifiedPrior | None = None,
    noticeable: float = 0.005,
) -> ExpertComparison:
    """Learn from each expert apart and from all together.

    Args:
        demonstrations: By expert.
        tools: On which their choices are compared.
        prior: What is assumed beside the demonstrations.
        noticeable: Relative extra cost under which two orders count as the same choice.
    """
    names = tuple(demonstrations)
    apart = tuple(certify(demonstrations[name], prior, tools) for name in names)
    chosen = tuple(tuple(_order(tool, c.weights) for c in apart) for tool in tools)
    likeness: Array = np.array(
        [[float(np.mean([kendall_tau(row[a], row[b]) for row in chosen])) for b in range(len(names))] for a in range(len(names))]
    )
    everyone = [d for name in names for d in demonstrations[name]]
    pooled = certify(everyone, prior, tools)
    found = [
        Disagreement(t, names[a], names[b], extra)
        for t, tool in enumerate(tools)
        for a in range(len(names))
        for b in range(a + 1, len(names))
        if (extra := extra_cost(tool, apart[a].weights, apart[b].weights, chosen[t][a], chosen[t][b])) > noticeable
    ]
    prior = prior or CertifiedPrior()
    clash = () if pooled.realisable else minimal_conflict(pool_for(everyone, prior, tools), range(len(everyone)), prior)
    return ExpertComparison(names, apart, chosen, likeness, tuple(sorted(found, key=lambda d: (-d.extra, d.tool))), pooled, clash)


def _order(tool: SequencingProblem, weights: Array) -> tuple[int, ...]:
    return tuple(int(a) for a in cheapest_orders(tool, weights[None])[0])


def extra_cost(tool: SequencingProblem, first: Array, second: Array, mine: Sequence, theirs: Sequence) -> float:
    """How much the two orders differ in cost to the one or the other expert, relative, whichever is more."""
    own, other = tool.feature_sum(mine), tool.feature_sum(theirs)
    sizes = [max(float(np.abs(w) @ np.abs(x)), 1e-300) for w, x in ((first, own), (second, other))]
    return max(abs(float((other - own) @ first)) / sizes[0], abs(float((own - other) @ second)) / sizes[1])
