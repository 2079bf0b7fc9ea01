"""What learning produces: weights that belong to one version of one feature set."""

from dataclasses import dataclass

from app.errors import StalePolicy
from app.learning.qp import Array
from app.sequencing.features import Interaction
from app.sequencing.problem import SequencingProblem


@dataclass(frozen=True)
class Policy:
    """Everything needed to order a tool's regions."""

    weights: Array  # (n + m,) on the features as they are
    features: str  # name of the feature set
    version: int  # of the feature set
    interactions: tuple[Interaction, ...]
    effort_weights: Array | None  # (8,) or (10,) on effort_features, None when effort was not learned
    identifiable: tuple[bool, ...]  # (n + m,) False: no demonstrated tool could say anything about this weight

    def check(self, problem: SequencingProblem) -> None:
        """Refuse a tool this policy knows nothing about.

        Raises:
            StalePolicy: Another feature set, version or interactions.
        """
        mine = (self.features, self.version, self.interactions)
        theirs = (problem.features.name, problem.features.version, problem.interactions)
        if mine != theirs:
            raise StalePolicy(
                f"The policy was learned with feature set {self.features} version {self.version}; "
                f"this tool has {problem.features.name} version {problem.features.version}"
                f"{' and other interactions' if mine[:2] == theirs[:2] else ''}. Teach a new policy."
            )
