"""A file as it is, to be looked at while its import asks: bodies standing as they would with a direction up."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from app.errors import TooLarge
from app.geometry.importing import rotation_to_up
from app.geometry.parsed import ParsedFile
from app.geometry.tool import Mesh

MOST_FACES = 300_000  # triangles a browser draws at once without waiting


@dataclass(frozen=True)
class Preview:
    """The bodies of a file; its longest side is one metre, whatever its units."""

    mesh: Mesh  # standing on z = 0 over the origin, not cleaned
    body: NDArray[np.int64]  # (F,) index into names
    names: tuple[str, ...]


def preview(parsed: ParsedFile, up: str) -> Preview:
    """Stand a file upright.

    Raises:
        TooLarge: It has too many triangles to be drawn before it is read in.
    """
    kept = parsed.body >= 0
    if kept.sum() > MOST_FACES:
        raise TooLarge(f"The file holds {kept.sum():,} triangles; up to {MOST_FACES:,} are drawn before it is read in.")
    used, corner = np.unique(parsed.faces[kept], return_inverse=True)
    turned = parsed.vertices[used] @ rotation_to_up(up).T
    low, high = turned.min(axis=0), turned.max(axis=0)
    foot = np.array([(low[0] + high[0]) / 2, (low[1] + high[1]) / 2, low[2]])
    mesh = Mesh((turned - foot) / max(float((high - low).max()), 1e-300), corner.reshape(-1, 3).astype(np.int32))
    return Preview(mesh, parsed.body[kept], tuple(body.name for body in parsed.bodies))
