"""The order a policy chooses for a tool, with its reasons."""

from collections.abc import Callable
from dataclasses import dataclass

from app.learning.effort_features import effort_ends, effort_penalty, only_ends
from app.learning.policy import Policy
from app.learning.qp import Array
from app.sequencing.bounds import lower_bound
from app.sequencing.constraints import Constraints, resolve
from app.sequencing.features import Feature
from app.sequencing.problem import SequencingProblem
from app.sequencing.shortest import gap_between, shortest_sequence


@dataclass(frozen=True)
class Prediction:
    """The cheapest sequence of a tool under a policy."""

    sequence: tuple[int, ...]
    cost: float
    ties: int  # sequences of this cost, this one included
    counted: bool  # False: there may be more ties than `ties`
    proved: bool  # no sequence is cheaper, for certain
    bound: float  # no sequence costs less; -inf when nothing can be said
    method: str
    effort: float | None  # eta of the sequence, None when effort was not learned
    step_parts: Array  # (N, n + m) w * phi of each step; adds up to the cost
    labels: tuple[Feature, ...]  # (n + m)
    tie_settled_by: str | None  # plain words, None without ties

    @property
    def gap(self) -> float:
        """At most how far the cost lies above the optimum, as a share of |cost|."""
        return gap_between(self.cost, self.bound)


def predict(
    problem: SequencingProblem,
    policy: Policy,
    should_stop: Callable[[], bool] = lambda: True,
    constraints: Constraints | None = None,
) -> Prediction:
    """The lowest-cost sequence; among equally cheap ones the one of least effort (Eq. 8), then the lowest region ids.

    Where the sequence can't be proved the cheapest, a lower bound says how far it may be off; `should_stop` ends the search
    for a better bound (by default the first one will do), and never changes the sequence.

    Raises:
        StalePolicy: The policy belongs to another feature set, version or interactions.
        ContradictoryConstraints: The constraints can't hold together.
    """
    policy.check(problem)
    effort = policy.effort_weights
    breaks = effort is not None and bool((effort != 0).any())
    tie_break = None
    if effort is not None and breaks:
        tie_break = effort_ends(problem, effort) if only_ends(effort) else lambda s: effort_penalty(problem, effort, s)
    best = shortest_sequence(problem, policy.weights, tie_break, constraints)
    bound = best.cost
    if not best.proved:
        bound = lower_bound(problem, policy.weights, best.cost, resolve(constraints, problem.n), should_stop=should_stop)
    settled = None
    if best.ties > 1:
        way = "on the way" if effort is not None and not only_ends(effort) else "at start and end"
        settled = f"least effort {way}" if breaks else "region names: no effort was learned"
    return Prediction(
        sequence=best.sequence,
        cost=best.cost,
        ties=best.ties,
        counted=best.counted,
        proved=best.proved,
        bound=bound,
        method=best.method,
        effort=None if effort is None else effort_penalty(problem, effort, best.sequence),
        step_parts=problem.steps_of(best.sequence) * policy.weights,
        labels=problem.columns,
        tie_settled_by=settled,
    )
