"""Experts who err, in `apprentice bench learning`: how many tools come out right, answers checked and taken at their word."""

from collections.abc import Callable, Iterator

import numpy as np

from app.benches.figures import Figure
from app.learning.certified_run import Memory, certified_step, start_certified
from app.learning.certified_state import CertifiedParameters
from app.learning.comparing import made_up_case
from app.learning.expert import SAME, ScriptedExpert
from app.learning.hits import judge
from app.learning.performance_state import LearningDemonstration
from app.learning.scripted import Answers
from app.sequencing.problem import SequencingProblem
from app.sequencing.shortest import shortest_sequence

WRONG = 0.15  # share of the answers
BLUNTNESS = 0.004  # relative extra cost at which an order passes for the best one with probability 1 / e
MOST = 40
TOLERANCE = 1e-7  # relative extra cost up to which a tool is right
CHECKED = CertifiedParameters(tolerance=SAME, most=MOST)
TRUSTED = CertifiedParameters(tolerance=SAME, most=MOST, check=10**6)  # nothing is asked again on purpose
Reply = Callable[[SequencingProblem, tuple[int, ...], tuple[int, ...]], str]
Shown = dict[int, LearningDemonstration]


def noisy_figures(shown: Shown, seeds: int) -> Iterator[Figure]:
    """On the authors' synthetic tools, one order recorded, nine tools to learn."""
    for kind in ("none", "uniform", "near ties"):
        group = f"experts who err ({seeds}), 1 demonstration, 9 unseen tools: {_WORDS[kind]}"
        for name, parameters in (("answers checked", CHECKED), ("taken at their word", TRUSTED)):
            runs = [_run(shown, k, kind, parameters) for k in range(seeds)]
            right, cost, asked, wrong = (float(np.mean([r[i] for r in runs])) for i in range(4))
            note = f"extra cost {cost:.2%}, answers {asked:.1f}, of them wrong {wrong / asked:.0%}"
            yield Figure(group, f"tools right, {name}", right, "of 9", note=note)


_WORDS = {
    "none": "no errors",
    "uniform": "15 % of the answers wrong at random",
    "near ties": "orders nearly as good pass for the best (Boltzmann)",
}


def _run(shown: Shown, k: int, kind: str, parameters: CertifiedParameters) -> tuple[float, float, float, float]:
    """Tools right, mean relative extra cost, answers, wrong answers."""
    problems = {i: d.problem for i, d in shown.items()}
    case = made_up_case(problems, (list(problems)[k % len(problems)],), k)
    expert, tools = ScriptedExpert(case.truth, None), [d.problem for d in case.test]
    generator, known = np.random.default_rng([k, 99]), list(case.train)
    state, answers, memory, wrong = start_certified(known, tools, parameters, k), Answers(), Memory.empty(), 0
    while True:
        result = certified_step(known, tools, parameters, state, answers, memory)
        state = result.state
        if result.outcome != "questions":
            break
        for q in result.questions:
            true = expert.chooses(tools[q.tool], q.left, q.right)
            said = _said(expert, tools[q.tool], (q.left, q.right), true, kind, generator)
            wrong += said != true
            answers[q.fingerprint] = said
            if said == "both_wrong" and not any(d.problem is tools[q.tool] for d in known):
                known.append(LearningDemonstration(tools[q.tool], expert.sequence(tools[q.tool])))
                memory = Memory.empty()
    gaps = [judge(p, result.weights, expert.sequence(p)).gap for p in tools]
    return sum(g <= TOLERANCE for g in gaps), float(np.mean(gaps)), len(answers), wrong


def _said(
    expert: ScriptedExpert, tool: SequencingProblem, pair: tuple[tuple[int, ...], ...], true: str, kind: str, generator: np.random.Generator
) -> str:
    """An answer of an expert who errs."""
    if kind == "none":
        return true
    if kind == "uniform":
        others = [v for v in ("left", "right", "both_wrong") if v != true]
        return str(generator.choice(others)) if generator.random() < WRONG else true
    weights = np.asarray(expert.weights)
    best = shortest_sequence(tool, weights).cost
    passes = [generator.random() < np.exp(-(tool.cost(weights, s) / best - 1) / BLUNTNESS) for s in pair]
    if all(passes) and true != "equal":
        return ("left", "right")[int(generator.random() < 0.5)]
    return {(True, True): "equal", (True, False): "left", (False, True): "right", (False, False): "both_wrong"}[passes[0], passes[1]]
