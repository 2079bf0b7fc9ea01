"""An expert made of known weights, for studies, tests and the sample project's demonstrations."""

from dataclasses import dataclass

import numpy as np

from app.learning.effort_features import effort_penalty
from app.learning.qp import Array
from app.sequencing.problem import SequencingProblem
from app.sequencing.shortest import TOLERANCE, shortest_sequence

Sequence = tuple[int, ...]
SAME = 1e-9  # relative: costs closer than this are equal to the expert


@dataclass(frozen=True)
class ScriptedExpert:
    """Works by fixed weights and answers by them, without noise.

    Without performance weights the expert only calls orders with the same feature sum just as good; that is all the
    authors' real tools let anyone say about their expert.
    """

    weights: Array | None  # (n + m,)
    effort_weights: Array | None  # (8,) or (10,)

    def sequence(self, problem: SequencingProblem) -> Sequence:
        """The order this expert would demonstrate."""
        weights = np.zeros(len(problem.columns)) if self.weights is None else self.weights
        effort = self.effort_weights
        return shortest_sequence(problem, weights, None if effort is None else lambda s: effort_penalty(problem, effort, s)).sequence

    def similar(self, problem: SequencingProblem, demonstrated: Sequence, candidate: Sequence) -> str:
        """'similar' when the candidate has the demonstration's feature sum or costs this expert no more, else 'not_similar'."""
        first, second = problem.feature_sum(demonstrated), problem.feature_sum(candidate)
        if np.allclose(first, second, rtol=1e-9, atol=1e-9):
            return "similar"
        if self.weights is None:
            return "not_similar"
        excess = float(self.weights @ (second - first))
        return "similar" if excess <= TOLERANCE * float(np.abs(self.weights) @ np.abs(first)) else "not_similar"

    def prefers(self, problem: SequencingProblem, left: Sequence, right: Sequence) -> str:
        """'left', 'right' or 'equal', by effort."""
        if self.effort_weights is None:
            return "equal"
        gap = effort_penalty(problem, self.effort_weights, right) - effort_penalty(problem, self.effort_weights, left)
        return "equal" if abs(gap) < 1e-9 else ("left" if gap > 0 else "right")

    def chooses(self, problem: SequencingProblem, left: Sequence, right: Sequence) -> str:
        """'left', 'right', 'equal' or 'both_wrong': an order is how this expert would do it when it is a cheapest one."""
        weights = np.zeros(len(problem.columns)) if self.weights is None else self.weights
        best = shortest_sequence(problem, weights).cost
        first, second = (problem.cost(weights, s) <= best + SAME * abs(best) for s in (left, right))
        return {(True, True): "equal", (True, False): "left", (False, True): "right", (False, False): "both_wrong"}[first, second]
