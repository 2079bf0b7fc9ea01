"""Which two equivalent sequences to ask about: the pair that splits what is still possible for the effort penalty most evenly.

A place's left and right, back and front are two sides of one coin: z holds x and 1 - x, so only their difference counts and may
have either sign. In these four directions what the answers leave possible is sampled; a pair on which the samples are divided
halves it, so about log2 of the possible preferences are asked about and not every equivalent sequence. Travel and changes of side can
only be an effort or none at all, so half of the samples have a weight of 0 there until an answer says otherwise.
"""

from collections.abc import Sequence as Ordered
from dataclasses import dataclass

import numpy as np
from scipy.linalg import null_space

from app.learning.qp import Array
from app.learning.version_space import cone_of, sample

SAMPLES = 200
AGREED = 0.04  # a pair on which fewer samples than this disagree is decided
SAME = 1e-9
NONE = 1e-7  # a preference weaker than this is none
SIDES = np.kron(np.eye(4), np.array([[1.0, -1.0]]))  # (4, 8) difference of z to difference of x and y at start and end
DRAWS = 40  # times the samples, of which those are kept whose weights may be what they are


@dataclass(frozen=True)
class Candidate:
    """Two sequences that could be compared."""

    tool: int  # demonstration
    left: int  # index of the tool's choices
    right: int
    direction: Array  # (4 or 6,) z of right minus z of left: one number per side, then the columns that are switched on
    share: float  # samples that prefer left, half of those that have no preference


def candidates(places: Ordered[Array], strict: Ordered[Array], level: Ordered[Array], known: Ordered[Array], seed: int) -> list[Candidate]:
    """Pairs the answers leave open, the most telling first; one per direction.

    Args:
        places: Per tool, z of its choices (c, 8), or (c, 10) with travel and changes of side, whose weights are at least 0.
        strict: Differences d of which answers say w_z . d > 0.
        level: Differences of which they say w_z . d = 0.
        known: Differences that were asked about, whatever was said.
        seed: Of the samples.
    """
    width = max((z.shape[1] for z in places), default=8)
    samples = _samples(strict, level, seed, np.r_[np.zeros(4), np.ones(width - 8)])
    if not len(samples):
        return []
    found: list[Candidate] = []
    taken = _unit_rows([_sides(d) for d in known], width - 4)
    for tool, z in enumerate(places):
        for a in range(len(z)):
            for b in range(a + 1, len(z)):
                direction = _sides(z[b] - z[a])
                size = float(np.linalg.norm(direction))
                if np.abs(direction).max() < SAME or (np.abs(taken @ direction) > (1 - SAME) * size).any():
                    continue
                liked = samples @ direction
                left, right = float((liked > NONE).mean()), float((liked < -NONE).mean())
                if max(left, right, 1 - left - right) <= 1 - AGREED:
                    share = left + (1 - left - right) / 2
                    taken = np.vstack([taken, direction / size])
                    found.append(Candidate(tool, a, b, direction, share))
    return sorted(found, key=_order)


def _order(c: Candidate) -> tuple[float, float, int, int, int]:
    """Most evenly split first; then the fewest sides at once, which is easier to answer; then those farthest apart."""
    uneven = round(abs(c.share - 0.5) / 0.1)  # a tenth is within the noise of the samples
    sides = float((np.abs(c.direction) > SAME).sum()) - float(np.abs(c.direction).sum()) / 8
    return (uneven, sides, c.tool, c.left, c.right)


def _samples(strict: Ordered[Array], level: Ordered[Array], seed: int, signed: Array) -> Array:
    generator, width = np.random.default_rng(seed), len(signed)
    equal = _unit_rows([_sides(d) for d in level], width)
    if not strict:  # nothing bounds what is left: even over its directions
        basis = null_space(equal) if len(equal) else np.eye(width)
        drawn = generator.normal(size=(SAMPLES * (DRAWS if signed.any() else 1), basis.shape[1])) @ basis.T
        drawn = drawn[(drawn[:, signed > 0] >= -SAME).all(axis=1)][:SAMPLES]
        drawn = drawn / np.maximum(np.linalg.norm(drawn, axis=1, keepdims=True), 1e-300)
        return _with_none(drawn, np.zeros((0, width)), equal, signed)
    preferred = _unit_rows([_sides(d) for d in strict], width)
    drawn = sample(cone_of(np.vstack([preferred, equal, -equal]), signed), SAMPLES, generator)
    return _with_none(drawn, preferred, equal, signed)


def _with_none(drawn: Array, preferred: Array, equal: Array, signed: Array) -> Array:
    """The samples, and those of them with a signed weight put to 0 that still agree with the answers."""
    for k in np.flatnonzero(signed):
        without = drawn.copy()
        without[:, k] = 0.0
        agrees = (without @ preferred.T > NONE).all(axis=1) & (np.abs(without @ equal.T) <= NONE).all(axis=1)
        drawn = np.vstack([drawn, without[agrees]])
    return drawn


def _unit_rows(rows: list[Array], width: int) -> Array:
    return np.array([r / np.linalg.norm(r) for r in rows if np.linalg.norm(r) > SAME]).reshape(-1, width)


def _sides(difference: Array) -> Array:
    return np.r_[SIDES @ difference[:8], difference[8:]]
