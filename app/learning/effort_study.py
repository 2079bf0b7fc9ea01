"""Fig. 5: before and after an expert says where they like to start and end, or that short ways or few changes of side matter.

All equivalent sequences of a tool cost the same; which one is done is settled by region names until an effort penalty is learned.
A scripted expert prefers one side; the penalty is learned on the training tools and judged on tools it has not seen.
"""

from dataclasses import dataclass, replace

import numpy as np

from app.learning.effort import EffortParameters
from app.learning.effort_features import ALL_COLUMNS, EFFORT_COLUMNS, effort_penalty
from app.learning.expert import ScriptedExpert
from app.learning.performance_state import LearningDemonstration
from app.learning.qp import Array
from app.learning.scripted import answer_preferences
from app.sequencing.classes import CAP, optimal_sequences
from app.sequencing.shortest import shortest_sequence

LIKED = {"right": "left", "left": "right", "back": "front", "front": "back"}  # far right is an effort for who starts on the left
MORE = {"travel": "short ways", "side_changes": "few changes of side"}  # with the columns that can be switched on
SAME = 1e-9


@dataclass(frozen=True)
class SideResult:
    """One preferred side."""

    preference: str  # "starts left"
    answers: int
    trained: "Tally"  # tools asked about
    unseen: "Tally"


@dataclass(frozen=True)
class Tally:
    """How often the chosen order has the least effort."""

    tools: int  # on which the preference makes a difference at all
    before: int  # of these, right without an effort penalty
    after: int  # of these, right with the learned one


def study_effort(
    trained: list[LearningDemonstration], unseen: list[LearningDemonstration], weights: Array, parameters: EffortParameters | None = None
) -> list[SideResult]:
    """Every side, at the start and at the end; then short ways and few changes of side, with both columns switched on.

    Args:
        trained: Tools the expert answers about.
        unseen: Tools the penalty is judged on.
        weights: Performance weights, (n + m,).
        parameters: Of the effort learner.

    Paper: Fig. 5 shows one preference on one tool. "Right" means that of all cheapest sequences the chosen one has the least effort under
        the expert's own penalty.
    """
    parameters = parameters or EffortParameters()
    more = replace(parameters, travel=True, side_changes=True)
    widths = range(len(ALL_COLUMNS))
    return [_side(k, trained, unseen, weights, parameters if k < len(EFFORT_COLUMNS) else more) for k in widths]


def _side(
    k: int, trained: list[LearningDemonstration], unseen: list[LearningDemonstration], weights: Array, parameters: EffortParameters
) -> SideResult:
    key = ALL_COLUMNS[k][0]
    end, _, side = key.partition("_")
    preference = MORE[key] if key in MORE else f"{end}s {LIKED[side]}"
    expert = ScriptedExpert(weights, np.eye(parameters.width)[k])
    result, answers = answer_preferences(trained, weights, parameters, expert.prefers)
    return SideResult(preference, len(answers), *(_tally(part, weights, result.effort_weights, expert) for part in (trained, unseen)))


def _tally(shown: list[LearningDemonstration], weights: Array, learned: Array, expert: ScriptedExpert) -> Tally:
    told = [o for d in shown if (o := _judged(d, weights, learned, expert)) is not None]
    return Tally(len(told), sum(b for b, _ in told), sum(a for _, a in told))


def _judged(shown: LearningDemonstration, weights: Array, learned: Array, expert: ScriptedExpert) -> tuple[bool, bool] | None:
    """(right before, right after); None when every cheapest sequence is the same effort to the expert."""
    mine = expert.effort_weights
    assert mine is not None
    efforts = [effort_penalty(shown.problem, mine, s) for s in optimal_sequences(shown.problem, weights, CAP).sequences]
    if max(efforts) - min(efforts) < SAME:
        return None
    plain = shortest_sequence(shown.problem, weights).sequence
    settled = shortest_sequence(shown.problem, weights, lambda s: effort_penalty(shown.problem, learned, s)).sequence
    least = min(efforts) + SAME
    return effort_penalty(shown.problem, mine, plain) <= least, effort_penalty(shown.problem, mine, settled) <= least
