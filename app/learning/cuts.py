"""Constraint generation: what demonstrations say about the weights, found by asking for a cheaper sequence.

"This sequence is the cheapest of its tool" is one row for each of N! others. Only those are written down that some
weights, tried on the way, found cheaper; the exact oracle proves that no other one is missing.
"""

from collections.abc import Sequence as Ordered
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from app.learning.identifiable import Frame
from app.learning.many_optima import Orders, cheapest_orders, sums_of
from app.learning.performance_state import LearningDemonstration
from app.learning.qp import Array
from app.sequencing.problem import TENSOR_LIMIT

CHEAPER = 1e-9  # relative: a sequence cheaper by more than this is a cut
COSTLY = 4  # trials looked at on a tool above 14 regions, where each is a dynamic program of its own
SAME = 1e-9  # feature sums in coordinates closer than this are the same


@dataclass(frozen=True)
class Cut:
    """The sequence must not cost less than the demonstration of its tool."""

    owner: int  # demonstration
    sequence: tuple[int, ...]
    difference: Array  # (r,) its feature sum minus the demonstration's; difference . u >= 0


@dataclass
class CutPool:
    """Cuts found so far; they hold whichever of the demonstrations are looked at together."""

    frame: Frame
    demonstrations: list[LearningDemonstration]
    cuts: list[Cut] = field(default_factory=list)
    oracle_calls: int = 0
    _targets: list[Array] = field(default_factory=list)
    _known: set[tuple[int, bytes]] = field(default_factory=set)

    def copy(self) -> "CutPool":
        """The same, to go on from twice."""
        return CutPool(self.frame, [*self.demonstrations], [*self.cuts], self.oracle_calls, [*self._targets], set(self._known))

    def target(self, i: int) -> Array:
        """(r,) feature sum of a demonstration."""
        for d in self.demonstrations[len(self._targets) :]:
            self._targets.append(self.frame.reduce(d.problem.feature_sum(d.sequence)))
        return self._targets[i]

    def separate(self, trials: Array, members: Ordered[int]) -> NDArray[np.bool_]:
        """Add a cut for every demonstration and trial (T, r) whose cheapest sequence is another one.

        Sequences that are not cheaper but were the cheapest beside the demonstration are kept too: they are the ones a
        slightly different weight would prefer.

        Returns:
            (T,) trials under which every demonstration is the cheapest.
        """
        fine = np.ones(len(trials), np.bool_)
        if not len(trials):
            return fine
        weights, length = trials @ self.frame.lift.T, np.linalg.norm(trials, axis=1)
        for i in members:
            problem = self.demonstrations[i].problem
            count = len(trials) if problem.n <= TENSOR_LIMIT else min(len(trials), COSTLY)
            orders = cheapest_orders(problem, weights[:count])
            self.oracle_calls += count
            differences = self.frame.reduce(sums_of(problem, orders)) - self.target(i)
            size = np.linalg.norm(differences, axis=1)
            cheaper = np.einsum("tr,tr->t", differences, trials[:count]) < -CHEAPER * size * length[:count]
            fine[:count] &= ~(cheaper & (size > SAME))
            self._keep(i, orders, differences, size)
        return fine

    def _keep(self, i: int, orders: Orders, differences: Array, size: Array) -> None:
        keys = np.round(differences / np.maximum(size, 1e-300)[:, None], 9) + 0.0
        for t in np.flatnonzero(size > SAME):
            key = (i, keys[t].tobytes())
            if key not in self._known:
                self._known.add(key)
                self.cuts.append(Cut(i, tuple(int(a) for a in orders[t]), differences[t]))

    def of(self, members: Ordered[int]) -> list[Cut]:
        """The cuts of some demonstrations."""
        wanted = set(members)
        return [c for c in self.cuts if c.owner in wanted]


def unit_rows(differences: Ordered[Array], width: int) -> Array:
    """Rows of length 1, (m, r)."""
    rows = np.array(differences).reshape(-1, width)
    return rows / np.maximum(np.linalg.norm(rows, axis=1, keepdims=True), 1e-300)
