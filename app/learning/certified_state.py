"""What a certified run remembers between steps, and what a step reports."""

from dataclasses import dataclass
from typing import Any

from app.learning.pairs import PairQuestion
from app.learning.performance_conflict import Contradiction
from app.learning.performance_state import Metric
from app.learning.qp import Array


@dataclass(frozen=True)
class CertifiedParameters:
    """How a certified run decides."""

    tolerance: float = 0.005  # relative extra cost that nobody would notice: all samples within it agree
    samples: int = 64  # of the version space
    most: int = 12  # questions asked at all
    batch: int = 1  # questions asked at a time
    margin: float = 0.02  # compromise between contradicting demonstrations
    least: float = 0.01
    regularisation: float = 0.05
    check: int = 6  # after so many answers one is asked again
    endorse: bool = True  # choosing an order says "I would do it like this", not only "better than the other"


CERTIFIED_WORDS: dict[str, tuple[str, str]] = {
    "tolerance": ("ε", "Extra cost too small to matter"),
    "samples": ("S", "Samples of the possible weights"),
    "most": ("Q", "Questions asked at most"),
    "batch": ("B", "Questions asked at a time"),
    "check": ("R", "Answers before one is asked again as a check"),
    "margin": ("ζ", "Contradictions: margin wanted"),
    "least": ("w_min", "Contradictions: smallest weight"),
    "regularisation": ("λ", "Contradictions: keep weights small"),
}


@dataclass(frozen=True)
class ToolChance:
    """How sure the choice on one tool is."""

    tool: int  # index into the run's tools
    probability: float  # that the chosen sequence is in the expert's cheapest class
    extra: float  # largest relative extra cost under any weights that agree with what is known
    agreed: bool  # extra is at most the tolerance everywhere
    classes: int  # sequences that come into question
    samples: int  # of the weights behind the probability; 0 where it is no estimate


@dataclass(frozen=True)
class ConflictReport:
    """Demonstrations that exclude each other; without any one of them the rest fits."""

    members: tuple[int, ...]
    slack: tuple[float, ...]  # per member, how much dearer it is when the others are explained
    resolved: str  # a sentence, empty when nothing tried resolves it


@dataclass(frozen=True)
class Report:
    """The certificate in plain values, as it is stored and shown."""

    realisable: bool
    margin: float
    slack: tuple[float, ...]  # per demonstration
    class_sizes: tuple[int, ...]
    identifiable: tuple[bool, ...]
    intervals: tuple[tuple[float, float], ...]
    shares: tuple[float, ...]
    tools: tuple[ToolChance, ...]
    expected_wrong: float  # sum over tools of 1 - probability
    samples: int
    cuts: int
    oracle_calls: int
    proved: bool  # every demonstrated tool was searched completely
    conflicts: tuple[ConflictReport, ...] = ()
    unclear: tuple[str, ...] = ()  # fingerprints of answers that sit ill with the others
    weighed: bool = False  # the answers contradict each other, so they were weighed
    repeated: int = 0  # questions answered twice
    repeated_alike: int = 0  # of them, with the same answer

    def to_json(self) -> dict[str, Any]:
        """Plain JSON values."""
        fields = {name: getattr(self, name) for name in self.__dataclass_fields__}
        return {
            **{k: [list(x) if isinstance(x, tuple) else x for x in v] if isinstance(v, tuple) else v for k, v in fields.items()},
            "tools": [vars(t) for t in self.tools],
            "conflicts": [{**vars(c), "members": list(c.members), "slack": list(c.slack)} for c in self.conflicts],
        }


@dataclass(frozen=True)
class CertifiedState:
    """A certified run between two steps; with the answers it is all that is needed to go on."""

    seed: int
    demonstrations: str  # fingerprint of what the run started with
    asked: tuple[PairQuestion, ...] = ()
    latest: int = 0  # how many of them belong to the last round
    phase: str = "training"  # "training" | "questions" | "converged" | "infeasible"
    weights: tuple[float, ...] = ()  # (k,)
    steps: int = 0
    count: int = 0  # of the demonstrations the run started with; those recorded for it since come behind them. 0: all

    def to_json(self) -> dict[str, Any]:
        """Plain JSON values; floats survive bit for bit."""
        fields = {name: getattr(self, name) for name in self.__dataclass_fields__}
        asked = [{k: list(v) if isinstance(v, tuple) else v for k, v in vars(q).items()} for q in self.asked]
        return {**fields, "asked": asked, "weights": list(self.weights)}

    @staticmethod
    def from_json(value: dict[str, Any]) -> "CertifiedState":
        asked = tuple(_question_from(q) for q in value["asked"])
        rest: dict[str, Any] = {k: v for k, v in value.items() if k not in ("asked", "weights")}
        return CertifiedState(asked=asked, weights=tuple(value["weights"]), **rest)


def _question_from(value: dict[str, Any]) -> PairQuestion:
    fields: dict[str, Any] = {k: tuple(v) if isinstance(v, list) else v for k, v in value.items()}
    return PairQuestion(**fields)


@dataclass(frozen=True)
class CertifiedResult:
    """What a step hands back."""

    state: CertifiedState
    metrics: tuple[Metric, ...]
    outcome: str  # "questions" | "converged" | "infeasible"
    questions: tuple[PairQuestion, ...]  # those without an answer
    weights: Array  # (k,)
    message: str
    report: Report
    contradiction: Contradiction | None = None
