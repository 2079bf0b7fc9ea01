"""The one shape every learner has in a comparison."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

import numpy as np

from app.learning.performance_state import LearningDemonstration
from app.learning.policy import Policy
from app.learning.prediction import predict
from app.learning.qp import Array
from app.sequencing.problem import SequencingProblem

Sequence = tuple[int, ...]


@dataclass(frozen=True)
class Learned:
    """What a learner made of its demonstrations."""

    order: Callable[[SequencingProblem], Sequence]  # for any tool with the features of the demonstrated ones
    policy: Policy | None  # None: there are no weights, only orders
    answers: int = 0  # of the expert
    settled: Mapping[int, tuple[Sequence, ...]] = field(
        default_factory=dict[int, tuple[Sequence, ...]]
    )  # id of a problem -> the orders that questions about it settled on, all of equal features


Learner = Callable[[list[LearningDemonstration], np.random.Generator], Learned]


def by_weights(demonstrations: list[LearningDemonstration], weights: Array, live: tuple[bool, ...], answers: int = 0) -> Learned:
    """A learner's result as weights (n + m,) on the demonstrated tools' own features."""
    first = demonstrations[0].problem
    policy = Policy(weights, first.features.name, first.features.version, first.interactions, None, live)
    return Learned(lambda problem: predict(problem, policy).sequence, policy, answers)
