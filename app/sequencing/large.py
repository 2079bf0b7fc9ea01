"""Sequences of tools with more regions than the exact dynamic program can hold: best found, not proved.

Every cost depends on the set of finished regions only, so with everything before and after a stretch fixed, the best order
inside it is an exact dynamic program over the subsets of the stretch. A beam search gives the start; stretches are
re-ordered and single regions moved until nothing improves.
"""

import numpy as np
from numpy.typing import NDArray

from app.geometry.tool import Array
from app.sequencing.features import Sets
from app.sequencing.problem import SequencingProblem, all_sets

BEAM_WIDTH = 100
STRETCHES = (8, 9)  # regions re-ordered at a time, one whole descent each
SWEEPS = 40  # at most, over all stretches
IMPROVES = 1e-9  # relative gain below which a sweep counts as no improvement


def best_found(problem: SequencingProblem, w: Array) -> tuple[int, ...]:
    """The cheapest sequence of several descents; deterministic."""
    w = problem.check_weights(w)
    starts = [beam(problem, w, BEAM_WIDTH), beam(problem, w, 1)]
    found = [improve(problem, w, start, size) for start in starts for size in STRETCHES]
    return min(found, key=lambda s: (problem.cost(w, s), s))


def step_costs(problem: SequencingProblem, w: Array, done: Sets) -> Array:
    """Cost of every next region for each set (M, N), infinite where already done."""
    return np.where(done, np.inf, problem.values(done) @ w)


def beam(problem: SequencingProblem, w: Array, width: int) -> tuple[int, ...]:
    """Beam search over prefixes, one representative (the cheapest) per set of finished regions."""
    n = problem.n
    code = np.random.default_rng(5).integers(1, 2**62, n)  # a set is known by the xor of its members' codes
    done, cost, key = np.zeros((1, n), np.bool_), np.zeros(1), np.zeros(1, np.int64)
    back: list[tuple[NDArray[np.int64], NDArray[np.int64]]] = []
    for _ in range(n):
        total = cost[:, None] + step_costs(problem, w, done)
        parent, action = np.nonzero(np.isfinite(total))
        value, new_key = total[parent, action], key[parent] ^ code[action]
        order = np.lexsort((action, value, new_key))
        order = order[np.concatenate([[True], np.diff(new_key[order]) != 0])]
        order = order[np.argsort(value[order], kind="stable")[:width]]
        parent, action = parent[order], action[order]
        done = done[parent].copy()
        done[np.arange(len(order)), action] = True
        cost, key = value[order], new_key[order]
        back.append((parent, action))
    at, sequence = int(np.argmin(cost)), []
    for parent, action in reversed(back):
        sequence.append(int(action[at]))
        at = int(parent[at])
    return tuple(reversed(sequence))


def improve(problem: SequencingProblem, w: Array, sequence: tuple[int, ...], size: int) -> tuple[int, ...]:
    """Re-order stretches of `size` regions exactly, over and over, until a whole sweep gains nothing."""
    size = min(size, problem.n)
    starts = sorted({*range(0, problem.n - size + 1, max(1, size // 3)), problem.n - size})
    cost = problem.cost(w, sequence)
    for _ in range(SWEEPS):
        for start in starts:
            sequence = reorder(problem, w, sequence, start, size)
        lower = problem.cost(w, sequence)
        if lower > cost - IMPROVES * max(1e-300, abs(cost)):
            break
        cost = lower
    return sequence


def reorder(problem: SequencingProblem, w: Array, sequence: tuple[int, ...], start: int, size: int) -> tuple[int, ...]:
    """The best order of positions start .. start + size - 1 with everything else fixed."""
    items = np.array(sequence[start : start + size])
    inside = all_sets(size)
    done = np.zeros((len(inside), problem.n), np.bool_)
    done[:, list(sequence[:start])] = True
    done[:, items] = inside
    cost = step_costs(problem, w, done)[:, items]
    to_go, choice = np.zeros(len(inside)), np.zeros(len(inside), np.int64)
    count = inside.sum(axis=1)
    for layer in range(size - 1, -1, -1):
        states = np.flatnonzero(count == layer)
        total = cost[states] + to_go[states[:, None] | (1 << np.arange(size))]
        to_go[states], choice[states] = total.min(axis=1), total.argmin(axis=1)
    state, order = 0, []
    for _ in range(size):
        order.append(int(items[choice[state]]))
        state |= 1 << int(choice[state])
    return sequence[:start] + tuple(order) + sequence[start + size :]
