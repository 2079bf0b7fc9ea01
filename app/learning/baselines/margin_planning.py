"""Maximum margin planning (Ratliff, Bagnell, Zinkevich 2006; the paper's [13]) as an exact quadratic program.

min lambda/2 |w|^2 + mean_i zeta_i  with  w . Phi(demo_i) <= w . Phi(xi) - L_i(xi) + zeta_i  for every sequence xi, w >= 0.
L_i(xi) is the share of xi's steps that the demonstration does not take; it adds up over steps, so the most violated sequence is
an exact shortest path under costs lowered by the loss. Sequences are added until none is violated more than those known.
"""

import numpy as np

from app.errors import InvalidInput
from app.learning.baselines.learner import Learned, by_weights
from app.learning.maximum_entropy import Lesson, lessons_of
from app.learning.performance_state import LearningDemonstration
from app.learning.qp import Array, QuadraticProgram, solve
from app.sequencing import kernels
from app.sequencing.problem import TENSOR_LIMIT

PENALTY = 0.01  # lambda
ROUNDS = 60
ENOUGH = 1e-6  # a sequence violated by no more than this beyond its slack is not added


def plan_by_margin(demonstrations: list[LearningDemonstration], generator: np.random.Generator) -> Learned:
    """The quadratic program's weights; the generator is not used.

    Raises:
        InvalidInput: A tool has more regions than the table of all transitions can hold.
    """
    del generator
    found, scale, live = lessons_of(demonstrations)
    lessons = [lesson for lesson in found if isinstance(lesson, Lesson)]
    if len(lessons) < len(found):
        raise InvalidInput(f"Max-margin planning takes tools of at most {TENSOR_LIMIT} regions here; leave the larger ones out.")
    w = margin_weights(lessons, [d.sequence for d in demonstrations])
    return by_weights(demonstrations, w / scale * np.array(live), live)


def margin_weights(lessons: list[Lesson], sequences: list[tuple[int, ...]], penalty: float = PENALTY) -> Array:
    """w (F,) on scaled features."""
    size, d = len(lessons[0].total), len(lessons)
    masks = [_strange(lesson.n, s) for lesson, s in zip(lessons, sequences, strict=True)]
    rows: list[Array] = []
    losses: list[float] = []
    w, slack = np.zeros(size), np.zeros(d)
    for _ in range(ROUNDS):
        before = len(rows)
        for i, (lesson, strange) in enumerate(zip(lessons, masks, strict=True)):
            total, loss = _most_violated(lesson, strange, w)
            if w @ (lesson.total - total) + loss > slack[i] + ENOUGH:
                rows.append(np.r_[lesson.total - total, -np.eye(d)[i]])
                losses.append(loss)
        if len(rows) == before:
            break
        program = QuadraticProgram(
            curvature=np.r_[np.full(size, penalty), np.zeros(d)],
            slope=np.r_[np.zeros(size), np.full(d, 1 / d)],
            rows=np.vstack([*rows, -np.eye(size + d)]),
            limits=np.r_[-np.array(losses), np.zeros(size + d)],
        )
        found = solve(program)
        w, slack = np.maximum(found[:size], 0), found[size:]
    return w


def _strange(n: int, sequence: tuple[int, ...]) -> Array:
    """(2^n, n) the loss of each transition: 1 / n, or 0 on the demonstration's own path."""
    loss, state = np.full((1 << n, n), 1 / n), 0
    for a in sequence:
        loss[state, a] = 0.0
        state |= 1 << a
    return loss


def _most_violated(lesson: Lesson, loss: Array, w: Array) -> tuple[Array, float]:
    """Feature sum and loss of the sequence of the lowest cost minus loss."""
    n = lesson.n
    table = lesson.values @ w - loss
    to_go = kernels.lowest_to_go(table, n)
    total, missed, state = np.zeros(len(w)), 0.0, 0
    while state != (1 << n) - 1:
        left = [a for a in range(n) if not state >> a & 1]
        a = min(left, key=lambda a: table[state, a] + to_go[state | 1 << a])
        total, missed = total + lesson.values[state, a], missed + loss[state, a]
        state |= 1 << a
    return total, float(missed)
