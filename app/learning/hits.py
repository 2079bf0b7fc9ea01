"""Does a policy choose the recorded order? The one definition every study and bench uses."""

from dataclasses import dataclass

from app.learning.qp import Array
from app.sequencing.classes import class_size, omega_size
from app.sequencing.comparison import kendall_tau
from app.sequencing.problem import SequencingProblem
from app.sequencing.shortest import shortest_sequence

HIT_GAP = 1e-7  # relative
HIT_SIZE = 64

Sequence = tuple[int, ...]


@dataclass(frozen=True)
class Outcome:
    """How well weights explain one tool's recorded order.

    A hit is a recorded order in the lowest cost class (relative 1e-7) of at most 64 orders, or of equivalent orders only. Without
    the size rule weights under which everything ties would hit everywhere.
    """

    hit: bool
    class_size: int  # orders in the lowest cost class
    gap: float  # relative excess of the recorded order's cost
    tau: float  # Kendall tau of the predicted order to the recorded one
    predicted: Sequence


def judge(problem: SequencingProblem, weights: Array, recorded: Sequence, predicted: Sequence | None = None) -> Outcome:
    """Compare the cheapest order under the weights with the recorded one.

    Args:
        problem: The tool.
        weights: (n + m,).
        recorded: The expert's order.
        predicted: The order chosen among equally cheap ones; that of the lowest region ids if None.
    """
    chosen = shortest_sequence(problem, weights).sequence if predicted is None else predicted
    cost = problem.cost(weights, chosen)
    gap = (problem.cost(weights, recorded) - cost) / max(abs(cost), 1e-12)
    size = class_size(problem, weights)
    hit = gap <= HIT_GAP and (size <= HIT_SIZE or only_equivalents(problem, recorded, size))
    return Outcome(hit, size, gap, kendall_tau(chosen, recorded), chosen)


def only_equivalents(problem: SequencingProblem, recorded: Sequence, size: int) -> bool:
    """Whether the class of that size holds nothing but orders with the recorded one's feature sum."""
    members, all_of_them = omega_size(problem, recorded)
    return all_of_them and members == size
