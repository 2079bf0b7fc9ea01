"""A scripted expert takes each learner to its end: studies, benches and tests have nobody to wait for."""

from collections.abc import Callable
from collections.abc import Sequence as Ordered
from dataclasses import dataclass

import numpy as np

from app.learning.answering import candidates_for, reply_of
from app.learning.certified_run import Memory, certified_step, start_certified
from app.learning.certified_state import CertifiedParameters
from app.learning.effort import EffortParameters, EffortStepResult, effort_step, start_effort
from app.learning.exception_run import ExceptionMemory, ExceptionParameters, ExceptionState, exception_step
from app.learning.expert import SAME, ScriptedExpert
from app.learning.generalising import Generalised
from app.learning.hits import judge
from app.learning.performance import performance_step
from app.learning.performance_state import LearningDemonstration, PerformanceParameters, PerformanceState, StepResult
from app.learning.qp import Array
from app.sequencing.problem import SequencingProblem

Sequence = tuple[int, ...]
Clock = Callable[[], float]
Answers = dict[str, str]

UNTIL_SURE = CertifiedParameters(tolerance=SAME, most=40)  # stop only when all samples choose the same
# the weights stored with the authors' code; unlike equal weights they make every recorded order of the synthetic tools a cheapest one
SYNTHETIC_TRUTH = (0.1, 0.1, 0.1, 0.1, 11.36, 1.0917, 1.0917, 0.4535, 0.1, 0.805)


def answer_similarity(
    demonstrations: list[LearningDemonstration],
    expert: ScriptedExpert,
    parameters: PerformanceParameters,
    state: PerformanceState,
    chunk: int | None = None,
    answers: Answers | None = None,
    report: Callable[[str], None] = lambda text: None,
) -> tuple[StepResult, Answers]:
    """Algorithm 1 to its end.

    Args:
        demonstrations: Tools with the expert's sequences.
        expert: Says whether a sequence is just as good as the demonstrated one.
        parameters: Hyperparameters.
        state: Where to begin.
        chunk: Updates per step; all that are allowed if None.
        answers: Gets every answer; those already in it are not given again.
        report: Called with each step's message.
    """
    answers = {} if answers is None else answers
    while True:
        result = performance_step(demonstrations, parameters, state, answers, chunk or parameters.iterations)
        state = result.state
        report(result.message)
        for q in result.questions:
            d = demonstrations[q.demonstration]
            answers[q.fingerprint] = expert.similar(d.problem, d.sequence, q.candidate)
        if result.outcome not in ("training", "questions"):
            return result, answers


def answer_preferences(
    demonstrations: list[LearningDemonstration],
    weights: Array,
    parameters: EffortParameters,
    prefers: Callable[[SequencingProblem, Sequence, Sequence], str],
    seed: int = 0,
) -> tuple[EffortStepResult, Answers]:
    """Algorithm 2 to its end; `prefers` gets the tool, the left and the right sequence."""
    answers: Answers = {}
    state = start_effort(demonstrations, weights, parameters, seed)
    while True:
        result = effort_step(demonstrations, parameters, state, answers)
        state = result.state
        for q in result.questions:
            answers[q.fingerprint] = prefers(demonstrations[q.demonstration].problem, q.left, q.right)
        if result.outcome != "questions":
            return result, answers


@dataclass(frozen=True)
class Taught:
    """A certified run at its end."""

    weights: Array
    identifiable: tuple[bool, ...]
    answers: int
    shown: int  # tools on which neither order was right, so that the expert recorded one, which the run then learned from
    wrong: int  # tools of interest whose best order under the expert's weights is not the cheapest
    cpu_s: float  # of the learner, without the expert's thinking
    longest_s: float  # from an answer to the next question or the end, the longest


def answer_pairs(
    demonstrations: list[LearningDemonstration],
    tools: Ordered[SequencingProblem],
    expert: ScriptedExpert,
    seed: int = 0,
    parameters: CertifiedParameters = UNTIL_SURE,
    clock: Clock = lambda: 0.0,
) -> Taught:
    """A certified run to the end it finds by itself; after "both are wrong" the expert records an order, as the product asks for.

    Args:
        demonstrations: Tools with the expert's sequences.
        tools: Those the run is interested in and asks about.
        expert: Of known weights.
        seed: Of the run.
        parameters: How it decides.
        clock: For the times; without one they are 0.
    """
    known, started, spent, longest = list(demonstrations), clock(), 0.0, 0.0
    state, answers, memory = start_certified(known, tools, parameters, seed), Answers(), Memory.empty()
    while True:
        result = certified_step(known, tools, parameters, state, answers, memory)
        state, took = result.state, clock() - started
        spent, longest = spent + took, max(longest, took if answers else 0.0)
        if result.outcome != "questions":
            break
        for q in result.questions:
            answers[q.fingerprint] = expert.chooses(tools[q.tool], q.left, q.right)
            if answers[q.fingerprint] == "both_wrong":
                known.append(LearningDemonstration(tools[q.tool], expert.sequence(tools[q.tool])))
                memory = Memory.empty()  # it is what follows from fewer demonstrations
        started = clock()
    wrong = sum(judge(p, result.weights, expert.sequence(p)).gap > SAME for p in tools)
    shown = len(known) - len(demonstrations)
    return Taught(result.weights, result.report.identifiable, len(answers), shown, wrong, spent, longest)


def answer_about(
    learned: Generalised, tool: SequencingProblem, wanted: tuple[Sequence, ...], seed: int = 0, most: int = ExceptionParameters.most
) -> tuple[Sequence, int]:
    """Questions about one tool to their end: the order that is settled, empty if none is, and the answers it took.

    Args:
        learned: From the demonstrations of other tools.
        tool: The one that is asked about.
        wanted: Any of them is as good to the expert as another.
        seed: Of the candidates.
        most: Questions asked at most.
    """
    memory = ExceptionMemory(candidates_for(tool, learned, np.random.default_rng([seed, 17])))
    state, answers = ExceptionState(seed), Answers()
    while True:
        result = exception_step((), tool, ExceptionParameters(most), state, answers, memory)
        state = result.state
        for q in result.questions:
            answers[q.fingerprint] = reply_of(q.left, q.right, wanted)
        if not result.questions:
            return state.order, len(answers)
