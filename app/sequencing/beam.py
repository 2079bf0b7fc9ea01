"""Beam search: a start for the search over large tools."""

import numpy as np
from numpy.typing import NDArray

from app.geometry.tool import Array
from app.sequencing.constraints import Resolved, resolve
from app.sequencing.problem import SequencingProblem


def beam(problem: SequencingProblem, w: Array, width: int, resolved: Resolved | None = None) -> tuple[int, ...]:
    """Beam search over prefixes, one representative (the cheapest) per set of finished regions.

    Holds precedence, skipped and finished regions; forbidden neighbours are left to the search that starts here. The
    regions finished before are not part of the answer.
    """
    n, r = problem.n, resolved or resolve(None, problem.n)
    code = np.random.default_rng(5).integers(1, 2**62, n)  # a set is known by the xor of its members' codes
    done, cost, key = np.zeros((1, n), np.bool_), np.zeros(1), np.zeros(1, np.int64)
    done[0, list(r.done)] = True
    open_, before = np.isin(np.arange(n), r.free), r.before.astype(np.float64)
    back: list[tuple[NDArray[np.int64], NDArray[np.int64]]] = []
    for _ in r.free:
        ready = open_ & ~done & ((~done & open_) @ before == 0)
        total = cost[:, None] + np.where(ready, problem.values(done) @ w, np.inf)
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
