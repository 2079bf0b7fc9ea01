"""A scripted expert takes a certified run to its end: answers, time and what is right afterwards."""

import time
from dataclasses import dataclass

import numpy as np

from app.learning.certified_run import Memory, certified_step, start_certified
from app.learning.certified_state import CertifiedParameters
from app.learning.hits import judge
from app.learning.pairs import PairQuestion
from app.learning.performance_state import LearningDemonstration
from app.learning.qp import Array
from app.sequencing.problem import SequencingProblem
from app.sequencing.shortest import shortest_sequence

SAME = 1e-9  # relative: costs closer than this are equal to the expert
# the weights stored with the authors' code; unlike equal weights they make every recorded order of the synthetic tools a cheapest one
SYNTHETIC_TRUTH = (0.1, 0.1, 0.1, 0.1, 11.36, 1.0917, 1.0917, 0.4535, 0.1, 0.805)
UNTIL_SURE = CertifiedParameters(tolerance=1e-9, most=40)  # stop only when all samples choose the same


@dataclass(frozen=True)
class Taught:
    """One run."""

    weights: Array
    answers: int
    shown: int  # tools on which neither order was right, so that the expert has to record one
    wrong: int  # other tools of interest whose best order under the expert's weights is not the cheapest
    cpu_s: float  # of the learner, without the expert's thinking
    longest_s: float  # cpu from an answer to the next question or the end, the longest


def teach(
    demonstrations: list[LearningDemonstration],
    tools: list[SequencingProblem],
    truth: Array,
    seed: int = 0,
    parameters: CertifiedParameters = UNTIL_SURE,
) -> Taught:
    """Answer as an expert of known weights until the run stops of its own."""
    started, spent, longest = time.process_time(), 0.0, 0.0
    state, answers, memory = start_certified(demonstrations, tools, parameters, seed), dict[str, str](), Memory.empty()
    while True:
        result = certified_step(demonstrations, tools, parameters, state, answers, memory)
        state = result.state
        took = time.process_time() - started
        spent, longest = spent + took, max(longest, took if answers else 0.0)
        if result.outcome != "questions":
            break
        answers |= {q.fingerprint: reply(tools[q.tool], q, truth) for q in result.questions}
        started = time.process_time()
    shown = {q.tool for q in state.asked if answers[q.fingerprint] == "both_wrong"}
    wrong = [t for t, p in enumerate(tools) if t not in shown and judge(p, result.weights, shortest_sequence(p, truth).sequence).gap > SAME]
    return Taught(result.weights, len(answers), len(shown), len(wrong), spent, longest)


def reply(problem: SequencingProblem, asked: PairQuestion, truth: Array) -> str:
    """An order is how this expert would do it when it is a cheapest one."""
    best = shortest_sequence(problem, truth).cost
    left, right = (problem.cost(truth, s) <= best + SAME * abs(best) for s in (asked.left, asked.right))
    return {(True, True): "equal", (True, False): "left", (False, True): "right", (False, False): "both_wrong"}[left, right]


def made_up_truths(count: int, size: int) -> list[Array]:
    """Experts of random weights, always the same ones."""
    return [np.random.default_rng([0, 0, k]).exponential(size=size) for k in range(count)]
