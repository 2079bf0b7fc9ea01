"""What the samples of the version space say about a tool: which sequences come into question, and how sure the choice is."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from app.learning.certified import Explored
from app.learning.identifiable import Frame
from app.learning.many_optima import Orders, cheapest_orders, sums_of
from app.learning.qp import Array
from app.sequencing.problem import TENSOR_LIMIT, SequencingProblem

COSTLY = 12  # samples looked at on a tool above 14 regions
EQUAL = 1e-9  # relative: costs this close are the same
DIGITS = 7  # of a feature sum in its unit, by which sequences of one class are recognised


@dataclass(frozen=True)
class Outlook:
    """One tool under the centre and the samples. Classes are distinct feature sums that some sample finds cheapest."""

    orders: Orders  # (c, N) one sequence per class
    sums: Array  # (c, r) their feature sums in coordinates
    chosen: int  # class the centre finds cheapest
    favourite: NDArray[np.int64]  # (s,) class each sample finds cheapest
    exact: NDArray[np.bool_]  # (c, s) a class is among the cheapest of a sample
    close: NDArray[np.bool_]  # (c, s) it costs at most the tolerance more than the cheapest
    extra: Array  # (c, s) relative extra cost

    @property
    def probability(self) -> float:
        """Share of the samples under which the chosen sequence is in the cheapest class."""
        return float(self.exact[self.chosen].mean())

    @property
    def agreed(self) -> bool:
        """No sample finds a sequence more than the tolerance cheaper than the chosen one."""
        return bool(self.close[self.chosen].all())

    @property
    def worst(self) -> float:
        """Largest relative extra cost of the chosen sequence under any sample."""
        return float(self.extra[self.chosen].max())

    def sequence(self, index: int) -> tuple[int, ...]:
        """The sequence that stands for a class."""
        return tuple(int(a) for a in self.orders[index])


def outlook(problem: SequencingProblem, frame: Frame, explored: Explored, tolerance: float) -> Outlook:
    """Solve one tool under the centre and every sample.

    Args:
        problem: The tool.
        frame: Coordinates.
        explored: Not empty.
        tolerance: Relative extra cost that nobody would notice.
    """
    samples = explored.samples if problem.n <= TENSOR_LIMIT else explored.samples[:COSTLY]
    trials = np.vstack([explored.centre, samples])
    weights = frame.weights_of(trials)
    orders = cheapest_orders(problem, trials @ frame.lift.T)
    raw = sums_of(problem, orders)
    sums = frame.reduce(raw)
    keys = np.round(sums - sums[0], DIGITS) + 0.0
    _, first, mine = np.unique(keys, axis=0, return_index=True, return_inverse=True)
    mine = mine.ravel()
    cost = raw[first] @ weights.T
    size = np.einsum("tk,tk->t", np.abs(raw), np.abs(weights))
    extra = ((cost - cost.min(axis=0)) / np.maximum(size, 1e-300))[:, 1:]
    return Outlook(orders[first], sums[first], int(mine[0]), mine[1:], extra <= EQUAL, extra <= tolerance + EQUAL, extra)
