"""Questions about the one tool whose order the expert doubts: a few comparisons, then an order for that tool alone."""

from collections.abc import Mapping
from collections.abc import Sequence as Ordered
from dataclasses import dataclass, replace
from typing import Any, cast

import numpy as np

from app.learning.answering import Candidates, Reply, Sequence, after_answer, candidates_for, next_pair
from app.learning.generalising import learn_generalising
from app.learning.performance_state import LearningDemonstration
from app.learning.questions import differing_regions, fingerprint
from app.sequencing.problem import TENSOR_LIMIT, SequencingProblem

WHY = (
    "The first of at most {most} questions about this tool. Any answer helps: which one is your way, or which comes closer to it.",
    "Your answers so far leave several orders; this pair tells most of them apart.",
)


@dataclass(frozen=True)
class ExceptionParameters:
    """How many questions."""

    most: int = 3


EXCEPTION_WORDS: dict[str, tuple[str, str]] = {"most": ("Q", "Questions asked at most")}


@dataclass(frozen=True)
class ExceptionState:
    """A run about one tool between two steps."""

    seed: int
    asked: tuple[tuple[int, int], ...] = ()  # candidates, the left one first
    order: Sequence = ()  # empty until it is settled, and where the answers said nothing
    probability: float = 0.0  # of the order, given the answers; 1 when the expert said that it is theirs

    def to_json(self) -> dict[str, Any]:
        """Plain JSON values."""
        return {**vars(self), "asked": [list(pair) for pair in self.asked], "order": list(self.order)}

    @staticmethod
    def from_json(value: dict[str, Any]) -> "ExceptionState":
        return ExceptionState(value["seed"], tuple((a, b) for a, b in value["asked"]), tuple(value["order"]), value["probability"])


@dataclass
class ExceptionMemory:
    """The candidates before any answer; forgetting them costs only time."""

    candidates: Candidates | None = None


@dataclass(frozen=True)
class CloserQuestion:
    """Which of two orders is closer to how you would do it?"""

    left: Sequence
    right: Sequence
    why: str
    differs: Sequence
    fingerprint: str


@dataclass(frozen=True)
class ExceptionResult:
    """What a step hands back."""

    state: ExceptionState
    questions: tuple[CloserQuestion, ...]  # the one without an answer; none when it is over
    message: str


def exception_step(
    demonstrations: Ordered[LearningDemonstration],
    tool: SequencingProblem,
    parameters: ExceptionParameters,
    state: ExceptionState,
    answers: Mapping[str, str],
    memory: ExceptionMemory | None = None,
) -> ExceptionResult:
    """Ask the next question, or settle the order; pure and deterministic.

    Args:
        demonstrations: What the doubted policy was learned from.
        tool: The doubted one. Above 14 regions only orders through its likeliest sets are looked at, which the end says.
        parameters: How many questions.
        state: As the last step returned it.
        answers: By fingerprint; see `answering.Reply`.
        memory: Of earlier steps of this run.
    """
    memory = memory or ExceptionMemory()
    if memory.candidates is None:
        memory.candidates = candidates_for(tool, learn_generalising(list(demonstrations)), np.random.default_rng([state.seed, 17]))
    found = memory.candidates
    told = 0
    for pair in state.asked:
        asked = _question(found, pair, state, parameters)
        if asked.fingerprint not in answers:
            return ExceptionResult(state, (asked,), "Waiting for 1 answer.")
        reply = cast("Reply", answers[asked.fingerprint])
        found = after_answer(found, pair, reply)
        told += reply != "cant_tell"
        if reply in ("left_mine", "right_mine"):
            settled = replace(state, order=asked.left if reply == "left_mine" else asked.right, probability=1.0)
            return ExceptionResult(settled, (), "You said which order is yours; it counts for this tool.")
    pair = next_pair(found) if len(state.asked) < parameters.most else None
    if pair is not None:
        flip = np.random.default_rng([state.seed, 7, len(state.asked)]).random() < 0.5  # no side is always the likelier one
        after = replace(state, asked=(*state.asked, pair[::-1] if flip else pair))
        return ExceptionResult(after, (_question(found, after.asked[-1], state, parameters),), "Which order do you want on this tool?")
    if not told:
        return ExceptionResult(state, (), "Your answers say nothing about this tool, so its order stays as it was.")
    share = float(found.probability[found.best])
    words = (
        f"Of {len(found.classes)} orders that were looked at this one fits your answers best (probability {share:.0%}). "
        "Look at it, and drop it if it isn't yours."
    )
    if tool.n > TENSOR_LIMIT:
        words += f" With {tool.n} regions the probability counts only orders through the likeliest sets of finished regions."
    return ExceptionResult(replace(state, order=found.classes[found.best][0], probability=share), (), words)


def _question(found: Candidates, pair: tuple[int, int], state: ExceptionState, parameters: ExceptionParameters) -> CloserQuestion:
    left, right = (found.classes[c][0] for c in pair)
    why = WHY[0].format(most=parameters.most) if not state.asked or pair == state.asked[0] else WHY[1]
    return CloserQuestion(left, right, why, differing_regions(left, right), fingerprint("closer", 0, left, right))
