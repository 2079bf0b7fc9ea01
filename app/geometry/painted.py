"""The colours a CAD file gives its faces, region by region."""

import numpy as np

from app.geometry.cad_faces import Colour
from app.geometry.carry_over import PROBES, locate
from app.geometry.cleaning import areas
from app.geometry.importing import ImportedPart
from app.geometry.tool import Tool


def region_colours(tool: Tool, part: ImportedPart) -> tuple[Colour | None, ...]:
    """The colour most of each region is painted in; None where most of it has no colour.

    Args:
        tool: The part cut into regions; its triangles may be pieces of the part's.
        part: The part with the colours of its CAD faces.
    """
    known = sorted({face.colour for face in part.cad_faces if face.colour is not None})
    if not known:
        return (None,) * tool.n
    number = {colour: k for k, colour in enumerate(known)}
    paint = np.array([len(known) if face.colour is None else number[face.colour] for face in part.cad_faces] + [len(known)])
    painted = paint[part.cad_face[locate(tool.mesh, part.mesh, PROBES[:1])[:, 0]]]  # -1, no CAD face, is the last: no colour
    area = areas(tool.mesh.vertices, tool.mesh.faces.astype(np.int64))
    shares = np.zeros((tool.n, len(known) + 1))
    inside = tool.labels >= 0
    np.add.at(shares, (tool.labels[inside], painted[inside]), area[inside])
    return tuple([*known, None][k] for k in shares.argmax(axis=1).tolist())
