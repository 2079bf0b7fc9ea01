"""Costs between one region and the next: travel, turning, re-gripping, and neighbours in the order that are forbidden.

They depend on the region worked on last, so a state is a set and its last region: N times the states, exact to about 20 regions.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from app.geometry.compiled import kernel
from app.geometry.tool import Array
from app.sequencing.constraints import Resolved
from app.sequencing.features import Feature
from app.sequencing.forms import Form, step_costs

LAST_LIMIT = 20  # regions


@dataclass(frozen=True, eq=False)
class LastFeature:
    """A column whose value depends on the region before."""

    feature: Feature
    between: Array  # (N, N) [b, a]: a directly after b
    start: Array  # (N,) a first


def travel(positions: Array, home: Array | None = None) -> LastFeature:
    """Distance of the tool between region centres (N, 3), from `home` (3,) to the first; nothing to the first without it."""
    start = np.zeros(len(positions)) if home is None else np.linalg.norm(positions - home, axis=1)
    feature = Feature("travel", "Way from the region before", "phi_travel")
    return LastFeature(feature, np.linalg.norm(positions[:, None] - positions[None, :], axis=-1), start)


def reorientation(normals: Array) -> LastFeature:
    """Angle in rad between the unit normals (N, 3) of a region and the one before."""
    angle = np.arccos(np.clip(normals @ normals.T, -1, 1))
    np.fill_diagonal(angle, 0.0)  # rounding
    return LastFeature(Feature("turn", "Turn from the region before", "phi_turn"), angle, np.zeros(len(normals)))


def regripping(grip: NDArray[np.int64]) -> LastFeature:
    """1 where the grip (N,) or the tool in hand differs from the region before."""
    change = (grip[:, None] != grip[None, :]).astype(np.float64)
    return LastFeature(Feature("regrip", "Grip changed", "phi_regrip"), change, np.zeros(len(grip)))


def after_last(features: tuple[LastFeature, ...], w: Array, resolved: Resolved) -> Array:
    """What a free region adds after another, (N' + 1, N'), last row at the start; (0, 0) where nothing depends on it."""
    if not resolved.free or (not features and not resolved.parted):
        return np.zeros((0, 0))
    free = np.array(resolved.free, np.int64)
    between, start = np.where(resolved.never_next, np.inf, 0.0), np.zeros(len(resolved.before))
    for weight, f in zip(w, features, strict=True):
        between, start = between + weight * f.between, start + weight * f.start
    row = between[resolved.done[-1]] if resolved.done else start
    return np.ascontiguousarray(np.concatenate([between[np.ix_(free, free)], row[None, free]]))  # compiled code takes no other


@kernel(nogil=True)
def costs_to_go_by_last(form: Form, after: Array) -> NDArray[np.float32]:
    """V of every state and last region, (2^N * N,)."""
    n = form.start.shape[1]
    v, onward = np.full((1 << n) * n, np.inf, np.float32), np.empty(n)
    v[-n:] = 0
    for s in range((1 << n) - 2, 0, -1):
        step_costs(form, s, onward)
        for a in range(n):
            onward[a] += v[(s | 1 << a) * n + a]
        for b in range(n):
            if s >> b & 1:
                best = np.inf
                for a in range(n):
                    if not s >> a & 1:
                        best = min(best, after[b, a] + onward[a])
                v[s * n + b] = best
    return v
