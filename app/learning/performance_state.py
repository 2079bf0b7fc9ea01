"""What a performance run remembers between steps, and what a step reports."""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from app.learning.loss import LossTerms, LossValue
from app.learning.performance_conflict import Contradiction
from app.learning.qp import Array
from app.learning.questions import Sequence, SimilarityQuestion
from app.sequencing.problem import SequencingProblem


@dataclass(frozen=True)
class PerformanceParameters:
    """Hyperparameters of Algorithm 1 and Eq. 7, with three of our own (`floor`, `rounds`, `most`).

    Paper: alpha, beta, gamma, lambda, zeta, T, p, K are named there, their values are not. Ours were chosen by leaving out one of the
        six synthetic training tools at a time. They state a prior: with lambda and the floor this strong against alpha and beta, a weight
        leaves the floor only as far as the demonstrations demand, so what they leave open counts every feature alike (in units of
        its spread). gamma far above alpha and beta makes its part an exact penalty: a demonstration that *can* be the cheapest is.
    """

    alpha: float = 0.0025
    beta: float = 0.05
    gamma: float = 100.0
    zeta: float = 0.9
    regularisation: float = 1.0
    learning_rate: float = 0.004
    iterations: int = 5
    samples: int = 30
    classes: int = 3
    tolerance: float = 1e-3
    floor: float = 0.1
    rounds: int = 20
    most: int = 4

    @property
    def terms(self) -> LossTerms:
        return LossTerms(self.alpha, self.beta, self.gamma, self.regularisation)


PARAMETER_WORDS: dict[str, tuple[str, str]] = {
    "alpha": ("α", "Pull away from the average sample"),
    "beta": ("β", "Pull away from the closest sample"),
    "gamma": ("γ", "Push below the cheapest order"),
    "zeta": ("ζ", "How alike two samples may be"),
    "regularisation": ("λ", "Keep weights small"),
    "learning_rate": ("η", "Learning rate"),
    "iterations": ("T", "Steps per round"),
    "samples": ("p", "Samples per tool"),
    "classes": ("K", "Questions per tool and round"),
    "tolerance": ("ε", "Costs this close count as equal"),
    "floor": ("w_min", "Smallest weight of a feature"),
    "rounds": ("R", "Rounds before giving up"),
    "most": ("q", "Questions per round"),
}


@dataclass(frozen=True)
class LearningDemonstration:
    """A tool with the expert's sequence."""

    problem: SequencingProblem
    sequence: Sequence


@dataclass(frozen=True)
class Metric:
    """One gradient step, or the exact finish, as it is plotted."""

    iteration: int  # counts from 1 over all rounds; the exact finish counts as one
    loss: float
    terms: dict[str, float]  # alpha, beta, gamma, regularisation
    violations: int  # demonstrations that are not the cheapest on their tool

    @staticmethod
    def of(iteration: int, value: LossValue, violations: int) -> "Metric":
        terms = {"alpha": value.alpha, "beta": value.beta, "gamma": value.gamma, "regularisation": value.regularisation}
        return Metric(iteration, value.total, terms, violations)


@dataclass(frozen=True)
class PerformanceState:
    """A run between two steps. Whole: nothing else is needed to go on, on another machine or another day."""

    seed: int
    demonstrations: str  # fingerprint of the demonstrations the run started with
    scale: tuple[float, ...]  # (n + m,) unit of each feature sum
    identifiable: tuple[bool, ...]  # (n + m,) False: its sum never varies on these tools
    weights: tuple[float, ...]  # (n + m,) on scaled features
    samples: tuple[tuple[Sequence, ...], ...]  # X at the start, per demonstration
    generator: dict[str, Any]  # state of the run's random generator
    iteration: int = 0  # gradient steps so far, and one for the exact finish
    step: int = 0  # of the current round
    round: int = 1
    asked: tuple[SimilarityQuestion, ...] = ()  # all questions so far, oldest first
    latest: int = 0  # how many of them belong to the last round
    phase: str = "training"  # "training" | "questions" | "converged" | "infeasible"
    contradiction: Contradiction | None = None  # found after the first round

    def to_json(self) -> dict[str, Any]:
        """Plain JSON values; floats survive bit for bit (shortest repr)."""
        fields = {name: getattr(self, name) for name in self.__dataclass_fields__}
        fields["asked"] = [{name: getattr(q, name) for name in q.__dataclass_fields__} for q in self.asked]
        found = self.contradiction
        fields["contradiction"] = None if found is None else {name: getattr(found, name) for name in found.__dataclass_fields__}
        return _plain(fields)

    @staticmethod
    def from_json(value: dict[str, Any]) -> "PerformanceState":
        asked = tuple(SimilarityQuestion(**{k: _tuples(v) for k, v in q.items()}) for q in value["asked"])
        found = value.get("contradiction")
        contradiction = None if found is None else Contradiction(**{k: _tuples(v) for k, v in found.items()})
        fields = {k: v if k == "generator" else _tuples(v) for k, v in value.items()}
        return PerformanceState(**{**fields, "asked": asked, "contradiction": contradiction})

    def with_weights(self, w: Array) -> "PerformanceState":
        return replace(self, weights=tuple(float(x) for x in w))

    @property
    def w(self) -> Array:
        """Weights on scaled features, (n + m,)."""
        return np.array(self.weights)

    @property
    def policy_weights(self) -> Array:
        """Weights on the features as they are, (n + m,): what costs are computed with."""
        return self.w / np.array(self.scale)


@dataclass(frozen=True)
class StepResult:
    """What a learner step hands back."""

    state: PerformanceState
    metrics: tuple[Metric, ...]
    outcome: str  # "training" | "questions" | "converged" | "stalled" | "infeasible"
    questions: tuple[SimilarityQuestion, ...]  # those without an answer
    weights: Array  # (n + m,) on unscaled features
    message: str

    @property
    def contradiction(self) -> Contradiction | None:
        return self.state.contradiction


def _plain(value: Any) -> Any:
    if isinstance(value, dict):
        return {k: _plain(v) for k, v in value.items()}
    if isinstance(value, (list, tuple)):
        return [_plain(v) for v in value]
    return value


def _tuples(value: Any) -> Any:
    return tuple(_tuples(v) for v in value) if isinstance(value, list) else value
