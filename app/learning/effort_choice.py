"""Which two equivalent sequences to ask about: the pair that splits what is still possible for the effort penalty most evenly.

A place's left and right, back and front are two sides of one coin: z holds x and 1 - x, so only their difference counts and may
have either sign. In these four directions what the answers leave possible is sampled; a pair on which the samples are divided
halves it, so about log2 of the possible preferences are asked about and not every equivalent sequence.
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
SIDES = np.kron(np.eye(4), np.array([[1.0, -1.0]]))  # (4, 8) difference of z to difference of x and y at start and end


@dataclass(frozen=True)
class Candidate:
    """Two sequences that could be compared."""

    tool: int  # demonstration
    left: int  # index of the tool's choices
    right: int
    direction: Array  # (4,) z of right minus z of left, one number per side
    share: float  # samples that prefer left


def candidates(places: Ordered[Array], strict: Ordered[Array], level: Ordered[Array], known: Ordered[Array], seed: int) -> list[Candidate]:
    """Pairs the answers leave open, the most telling first; one per direction.

    Args:
        places: Per tool, z of its choices (c, 8).
        strict: Differences d (8,) of which answers say w_z . d > 0.
        level: Differences of which they say w_z . d = 0.
        known: Differences that were asked about, whatever was said.
        seed: Of the samples.
    """
    samples = _samples(strict, level, seed)
    if not len(samples):
        return []
    found: list[Candidate] = []
    taken = [_sides(d) for d in known]
    for tool, z in enumerate(places):
        for a in range(len(z)):
            for b in range(a + 1, len(z)):
                direction = _sides(z[b] - z[a])
                if np.abs(direction).max() < SAME or any(_parallel(direction, d) for d in taken):
                    continue
                share = float((samples @ direction > 0).mean())
                if min(share, 1 - share) >= AGREED:
                    taken.append(direction)
                    found.append(Candidate(tool, a, b, direction, share))
    return sorted(found, key=_order)


def _order(c: Candidate) -> tuple[float, float, int, int, int]:
    """Most evenly split first; then the fewest sides at once, which is easier to answer; then those farthest apart."""
    uneven = round(abs(c.share - 0.5) / 0.1)  # a tenth is within the noise of the samples
    sides = float((np.abs(c.direction) > SAME).sum()) - float(np.abs(c.direction).sum()) / 8
    return (uneven, sides, c.tool, c.left, c.right)


def _samples(strict: Ordered[Array], level: Ordered[Array], seed: int) -> Array:
    generator = np.random.default_rng(seed)
    equal = _unit_rows([_sides(d) for d in level])
    if not strict:  # nothing bounds what is left: even over its directions
        basis = null_space(equal) if len(equal) else np.eye(4)
        drawn = generator.normal(size=(SAMPLES, basis.shape[1])) @ basis.T
        return drawn / np.maximum(np.linalg.norm(drawn, axis=1, keepdims=True), 1e-300)
    rows = np.vstack([_unit_rows([_sides(d) for d in strict]), equal, -equal])
    return sample(cone_of(rows, np.zeros(4)), SAMPLES, generator)


def _unit_rows(rows: list[Array]) -> Array:
    return np.array([r / np.linalg.norm(r) for r in rows if np.linalg.norm(r) > SAME]).reshape(-1, 4)


def _sides(difference: Array) -> Array:
    return SIDES @ difference


def _parallel(a: Array, b: Array) -> bool:
    return abs(float(a @ b)) > (1 - SAME) * float(np.linalg.norm(a) * np.linalg.norm(b))
