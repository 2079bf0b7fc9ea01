"""Whether orders said to be right with 80 % are right four times out of five, in `apprentice bench learning`."""

import itertools
from collections.abc import Iterator

import numpy as np

from app.benches.figures import Figure
from app.geometry.tool import Array
from app.learning.certified_run import Memory, certified_step, start_certified
from app.learning.certified_state import CertifiedParameters
from app.learning.comparing import made_up_case
from app.learning.performance_state import LearningDemonstration
from app.sequencing.shortest import shortest_sequence

RECORDED = (1, 2, 3, 6)  # tools, drawn anew for every expert
STEPS = (0.0, 0.2, 0.5, 0.8, 0.95, 1.0, np.inf)  # of the stated probability; the last holds what every sample agrees on
RIGHT = 1e-7  # relative extra cost up to which a tool is right


def calibration_figures(shown: dict[int, LearningDemonstration], seeds: int) -> Iterator[Figure]:
    """On the authors' synthetic tools before any question is asked: what is stated of every unseen tool, and what came out."""
    told = np.concatenate([_stated(shown, count, k) for count in RECORDED for k in range(seeds)])
    group = f"stated sureness, made-up experts ({seeds}), 1 to 6 demonstrations"
    for low, high in itertools.pairwise(STEPS):
        mine = told[(told[:, 0] >= low) & (told[:, 0] < high)]
        if len(mine):
            name = "right where all samples agree" if low == 1 else f"right where {low:.0%} to {high:.0%} was stated"
            yield Figure(group, name, 100 * float(mine[:, 1].mean()), "%", note=f"stated {mine[:, 0].mean():.1%} on {len(mine)} tools")
    yield Figure(group, "right less stated, all tools", 100 * float((told[:, 1] - told[:, 0]).mean()), "points", note="below 0: too sure")


def _stated(shown: dict[int, LearningDemonstration], count: int, k: int) -> Array:
    """Per unseen tool, (tools, 2): the stated probability, and whether the chosen order is in the expert's cheapest class."""
    problems = {i: d.problem for i, d in shown.items()}
    recorded = np.random.default_rng([k, count]).permutation(list(problems))[:count]
    case = made_up_case(problems, tuple(int(i) for i in recorded), k)
    known, tools, parameters = list(case.train), [d.problem for d in case.test], CertifiedParameters()
    result = certified_step(known, tools, parameters, start_certified(known, tools, parameters, k), {}, Memory.empty())
    assert result.report is not None
    assert case.truth is not None
    rows = []
    for chance in result.report.tools:
        tool = tools[chance.tool]
        cost, least = tool.cost(case.truth, shortest_sequence(tool, result.weights).sequence), shortest_sequence(tool, case.truth).cost
        rows.append((chance.probability, float(cost - least <= RIGHT * abs(least))))
    return np.array(rows)
