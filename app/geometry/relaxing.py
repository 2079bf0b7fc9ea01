"""Move the borders between regions to where the fitted primitives say: greedy merging leaves them ragged on noisy meshes.

What a face would cost in each region is linear in its 54 numbers. A face alone says little under noise, so the costs are
averaged along the surface.
"""

import numpy as np

from app.geometry.compiled import kernel
from app.geometry.denoise import smooth_normals
from app.geometry.fitting import AREA, CYLINDER, NORMAL, PLANE, PRODUCT, SIZE, SPHERE, SQUARE, round_fit
from app.geometry.merge_tree import Integers
from app.geometry.quadrics import fit_any, fit_quadric, misfit
from app.geometry.splitting import connected
from app.geometry.tool import Array

ROUNDS = 6
SMOOTHING = 20  # rounds for the normals that tell creases
CREASE = 0.1  # difference of two of these normals across which costs are hardly averaged
SPREAD = 20  # rounds of averaging with the neighbours: about the square root of it in triangles


def relaxed(labels: Integers, sums: Array, pairs: Integers, weight: float, spread: int = SPREAD) -> Integers:
    """Labels (F,) with smoother and better placed borders; -1 stays, no label is lost or created.

    Args:
        labels: Region of each face, numbered without gaps.
        sums: (F, 54) numbers of the faces.
        pairs: (P, 2) neighbouring faces.
        weight: As for `fit`.
        spread: Over how many rounds costs are averaged.
    """
    n = int(labels.max()) + 1
    inner = pairs[(labels[pairs] >= 0).all(axis=1)]
    area = np.ascontiguousarray(sums[:, AREA])
    normals = smooth_normals(sums[:, NORMAL : NORMAL + 3] / area[:, None], area, inner, SMOOTHING, CREASE)
    like = np.exp(-((normals[inner[:, 0]] - normals[inner[:, 1]]) ** 2).sum(axis=1) / (2 * CREASE**2))
    for _ in range(ROUNDS):
        total = np.zeros((n, SIZE))
        np.add.at(total, labels[labels >= 0], sums[labels >= 0])
        cost = np.stack([misfit(sums, _surface(total[k], weight), weight) for k in range(n)], axis=1)
        cost = _averaged(cost, area, inner, like, spread)
        cost[~_near(labels, inner, n, spread)] = np.inf
        best = np.where(labels >= 0, np.argmin(cost, axis=1), -1)
        best = _without_islands(best, labels, sums[:, AREA], inner)
        if len(np.unique(best[best >= 0])) < n:
            return labels
        same = best == labels
        labels = best
        if same.mean() > 0.999:
            break
    return labels


def _surface(m: Array, weight: float) -> Array:
    """The fitted primitive as a quadric (10,) whose gradient is the unit normal on the surface."""
    out, q = np.empty(5), np.zeros(10)
    fit_any(m, weight, True, out)
    kind, middle = int(out[0]), m[PRODUCT[0, 1:4]] / m[0]
    spread = m[PRODUCT[1:4, 1:4]] - m[0] * np.outer(middle, middle)
    if kind == PLANE:
        normal = np.linalg.eigh(spread)[1][:, 0]
        normal *= np.sign(normal @ m[NORMAL : NORMAL + 3]) or 1.0
        q[0], q[1:4] = -normal @ middle, normal
    elif kind in (SPHERE, CYLINDER):
        centre = np.empty(3)
        across = np.eye(3) - np.outer(out[2:], out[2:])
        _, radius = round_fit(m, across, spread, middle, centre)
        q[0] = centre @ across @ centre - radius**2
        q[1:4] = -2 * across @ centre
        for i in range(3):
            for j in range(3):
                q[SQUARE[i, j]] += across[i, j]
        q *= np.sign(out[1]) / (2 * radius)
    else:
        fit_quadric(m, weight, q)
    return q


@kernel
def _averaged(cost: Array, area: Array, pairs: Integers, like: Array, rounds: int) -> Array:  # pragma: no cover - compiled
    """Costs per area (F, K), averaged along the surface."""
    now = cost / area.reshape(-1, 1)
    weight = area.copy()
    for k in range(len(pairs)):
        weight[pairs[k, 0]] += like[k] * area[pairs[k, 1]]
        weight[pairs[k, 1]] += like[k] * area[pairs[k, 0]]
    for _ in range(rounds):
        total = now * area.reshape(-1, 1)
        for k in range(len(pairs)):
            i, j = pairs[k]
            for c in range(total.shape[1]):
                total[i, c] += like[k] * area[j] * now[j, c]
                total[j, c] += like[k] * area[i] * now[i, c]
        now = total / weight.reshape(-1, 1)
    return now


@kernel
def _near(labels: Integers, pairs: Integers, n: int, rounds: int) -> np.ndarray:  # pragma: no cover - compiled
    """Regions (F, n) a face may join: those within a few triangles."""
    near = np.zeros((len(labels), n), np.bool_)
    for f in range(len(labels)):
        if labels[f] >= 0:
            near[f, labels[f]] = True
    for _ in range(int(2 * np.sqrt(rounds))):
        for k in range(len(pairs)):
            i, j = pairs[k]
            for c in range(n):
                either = near[i, c] or near[j, c]
                near[i, c] = either
                near[j, c] = either
    return near


def _without_islands(best: Integers, before: Integers, area: Array, pairs: Integers) -> Integers:
    """Each region keeps its largest piece; faces of its other pieces take the label most of their neighbours have."""
    piece = connected(best, pairs)
    size = np.bincount(piece, weights=area)
    owner = np.full(len(size), -1)
    owner[piece] = best
    largest = np.zeros(len(size), bool)
    for k in range(int(best.max()) + 1):
        mine = np.flatnonzero(owner == k)
        if len(mine):
            largest[mine[np.argmax(size[mine])]] = True
    loose = ~largest[piece] & (best >= 0)
    result = np.where(loose, -2, best)
    for _ in range(1000):
        open_pairs = pairs[(result[pairs] == -2).sum(axis=1) == 1]
        if len(open_pairs) == 0:
            break
        first = result[open_pairs[:, 0]] == -2
        empty = np.where(first, open_pairs[:, 0], open_pairs[:, 1])
        full = np.where(first, open_pairs[:, 1], open_pairs[:, 0])
        result[empty] = result[full]
    return np.where(result == -2, before, result)
