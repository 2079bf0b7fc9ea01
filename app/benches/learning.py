"""`apprentice bench learning`: hits, answers and time of the learners, beside the bars."""

import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from app.benches.calibration import calibration_figures
from app.benches.effort_figures import effort_figures
from app.benches.figures import Figure, Options
from app.benches.noisy import noisy_figures
from app.benches.studies import demonstrations
from app.errors import InvalidInput
from app.learning.certified import certify
from app.learning.certified_state import CertifiedParameters
from app.learning.comparing import made_up_case
from app.learning.evaluation import TRAINED_ON
from app.learning.expert import ScriptedExpert
from app.learning.generalising import LAYOUT, PENALTIES, Generalised, learn_generalising, on_features
from app.learning.hits import HIT_SIZE, Outcome, judge
from app.learning.maximum_entropy import lessons_of, surprise
from app.learning.performance import start_performance
from app.learning.performance_state import LearningDemonstration, PerformanceParameters
from app.learning.qp import Array
from app.learning.scripted import SYNTHETIC_TRUTH, Taught, answer_about, answer_pairs, answer_similarity
from app.sequencing.classes import equivalent_sequences
from app.sequencing.features import FEATURE_SETS

SEEDS, QUICK_SEEDS = 30, 3
ERRING = 20  # experts who err, each with three kinds of errors, answers checked and not
REPEATS = 20
ANSWERS = 3
DRAWS = 3  # of candidate orders per tool
Shown = dict[int, LearningDemonstration]


def measure(options: Options) -> Iterator[Figure]:
    """All figures; they need the authors' tables."""
    if options.data is None:
        raise InvalidInput("The learning bench needs the authors' tables: give their folder with --data.")
    synthetic = demonstrations("synthetic", options.data)
    seeds = QUICK_SEEDS if options.quick else SEEDS
    yield from _synthetic(synthetic)
    yield from _made_up(synthetic, seeds)
    yield from _real(options.data, options.quick)
    yield from _speed(synthetic)
    yield from effort_figures(synthetic)
    yield from calibration_figures(synthetic, seeds)
    yield from noisy_figures(synthetic, QUICK_SEEDS if options.quick else ERRING)


def _synthetic(shown: Shown) -> Iterator[Figure]:
    group = "authors' synthetic tools, split 6 / 4"
    trained, unseen = [[d for i, d in shown.items() if (i in TRAINED_ON["synthetic"]) is part] for part in (True, False)]
    truth = np.array(SYNTHETIC_TRUTH)
    tools = [d.problem for d in unseen]
    expert = ScriptedExpert(truth, None)
    runs = [answer_pairs(trained, tools, expert, parameters=CertifiedParameters(), clock=time.process_time) for _ in range(5)]
    weights = runs[0].weights
    yield Figure(group, "training tools hit", _hits(trained, weights), "of 6", 6, "at least", _sizes(trained, weights))
    yield Figure(group, "test tools hit", _hits(unseen, weights), "of 4", 4, "at least", _sizes(unseen, weights))
    yield Figure(group, "answers, with a stop of its own", runs[0].answers, "", 2, "at most")
    yield Figure(group, "cpu, warm", min(r.cpu_s for r in runs[1:]) * 1e3, "ms", 150, "at most")
    ready = min(r.longest_s for r in runs[1:]) * 1e3
    yield Figure(group, "from an answer to the next question, longest, warm", ready, "ms", 100, "at most", "cpu")
    alone = certify(trained).weights
    yield Figure(group, "no answers: training tools hit", _hits(trained, alone), "of 6", 6, "at least", _sizes(trained, alone))
    yield Figure(group, "no answers: test tools hit", _hits(unseen, alone), "of 4")
    paper, questions, spent = _paper(trained, truth)
    yield Figure(group, "paper mode: training tools hit", _hits(trained, paper), "of 6", 6, "at least", _sizes(trained, paper))
    yield Figure(group, "paper mode: test tools hit", _hits(unseen, paper), "of 4")
    yield Figure(group, "paper mode: answers", questions)
    yield Figure(group, "paper mode: cpu", spent * 1e3, "ms")
    same = all(r.weights.tobytes() == weights.tobytes() for r in runs)
    yield Figure(group, "same seed and answers give the same bytes", float(same), "", 1, "at least")


def _paper(trained: list[LearningDemonstration], truth: Array) -> tuple[Array, int, float]:
    """Algorithm 1 with the default hyperparameters: weights, answers, cpu seconds."""
    parameters, started = PerformanceParameters(), time.process_time()
    result, answers = answer_similarity(trained, ScriptedExpert(truth, None), parameters, start_performance(trained, parameters, 0))
    return result.weights, len(answers), time.process_time() - started


def _made_up(shown: Shown, seeds: int) -> Iterator[Figure]:
    problems = {i: d.problem for i, d in shown.items()}
    for count, bar in ((6, 2), (1, 10)):
        group = f"made-up experts ({seeds}), {count} demonstration{'s' if count > 1 else ''}, {10 - count} unseen tools"
        runs: list[Taught] = []
        for k in range(seeds):
            known = TRAINED_ON["synthetic"] if count == 6 else (list(problems)[k % len(problems)],)
            case = made_up_case(problems, known, k)
            expert, tools = ScriptedExpert(case.truth, None), [d.problem for d in case.test]
            runs.append(answer_pairs(list(case.train), tools, expert, seed=k, clock=time.process_time))
        spent = [r.answers + r.shown for r in runs]  # a tool on which both orders are wrong is recorded, which is work too
        note = f"mean {np.mean(spent):.1f}, most {max(spent)}; until all samples choose the same order everywhere"
        yield Figure(group, "answers and tools shown, median", float(np.median(spent)), "", bar, "at most", note)
        yield Figure(group, "of these tools shown (both orders were wrong), mean", float(np.mean([r.shown for r in runs])))
        yield Figure(group, "tools wrong at the stop, mean", float(np.mean([r.wrong for r in runs])), "", 0, "at most")
        yield Figure(group, "cpu per run, mean", float(np.mean([r.cpu_s for r in runs])) * 1e3, "ms")


def _real(data: Path, quick: bool) -> Iterator[Figure]:
    group = "authors' real tools, one left out at a time"
    shown = demonstrations("real", data)
    sets, penalties = ((LAYOUT,), PENALTIES[-1:]) if quick else (None, PENALTIES)
    outcomes: dict[int, Outcome] = {}
    named: set[tuple[int, int]] = set()
    draws = range(1 if quick else DRAWS)
    for i in list(shown)[: 2 if quick else None]:
        learned = learn_generalising([d for j, d in shown.items() if j != i], sets, penalties)
        problem = on_features(shown[i].problem, FEATURE_SETS[learned.policy.features])
        outcomes[i] = judge(problem, learned.policy.weights, shown[i].sequence)
        named |= {(i, seed) for seed in draws if _named(LearningDemonstration(problem, shown[i].sequence), learned, seed)}
    missed = ", ".join(str(i) for i, o in outcomes.items() if not o.hit) or "none"
    note = f"missed: {missed}; class sizes {', '.join(str(o.class_size) for o in outcomes.values())}"
    yield Figure(group, "hits, no answers", sum(o.hit for o in outcomes.values()), f"of {len(outcomes)}", 8, "at least", note)
    yield Figure(group, "Kendall tau, mean, no answers", float(np.mean([o.tau for o in outcomes.values()])), "", 0.92, "at least")
    missed = ", ".join(f"tool {i} in draw {seed + 1}" for i in outcomes for seed in draws if (i, seed) not in named) or "none"
    note = f"worst of {len(draws)} draws, missed: {missed}; an answer says which of two orders is right, or closer"
    worst = min(sum((i, seed) in named for i in outcomes) for seed in draws)
    yield Figure(group, f"hits after at most {ANSWERS} answers per tool", worst, f"of {len(outcomes)}", 10, "at least", note)


def _named(shown: LearningDemonstration, learned: Generalised, seed: int) -> bool:
    """Whether the order that is settled after at most three answers is the recorded one, or has the same features."""
    wanted = equivalent_sequences(shown.problem, shown.sequence, HIT_SIZE).sequences
    return answer_about(learned, shown.problem, wanted, seed, ANSWERS)[0] in wanted


def _speed(shown: Shown) -> Iterator[Figure]:
    largest = max(shown.values(), key=lambda d: d.problem.n)
    (lesson,), _, _ = lessons_of([largest])
    w = np.full(len(lesson.total), 0.5)
    surprise(lesson, w)
    spent = []
    for _ in range(REPEATS):
        started = time.process_time()
        surprise(lesson, w)
        spent.append(time.process_time() - started)
    yield Figure("likelihood", f"value and gradient, {lesson.n} regions", min(spent) * 1e3, "ms", 2, "at most", f"best of {REPEATS}")


def _hits(shown: list[LearningDemonstration], weights: Array) -> float:
    return sum(judge(d.problem, weights, d.sequence).hit for d in shown)


def _sizes(shown: list[LearningDemonstration], weights: Array) -> str:
    return "class sizes " + ", ".join(str(judge(d.problem, weights, d.sequence).class_size) for d in shown)
