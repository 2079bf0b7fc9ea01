"""Colours of the CAD file, region by region."""

import numpy as np

from app.geometry.cad_faces import CadFace
from app.geometry.cleaning import CleaningReport
from app.geometry.importing import ImportedPart
from app.geometry.moulds import sample_moulds
from app.geometry.painted import region_colours
from app.geometry.regions import measure


def test_most_of_the_surface_decides() -> None:
    """Region 0 all red, 1 mostly blue, 2 mostly without paint, 3 without a CAD face."""
    mould = sample_moulds()[0]
    tool = measure(mould.mesh, mould.labels)
    face = np.full(len(tool.labels), 2, np.int32)
    face[tool.labels == 0] = 0
    for region, face_of_some, kept in ((1, 0, 0.25), (2, 1, 0.25)):
        inside = np.flatnonzero(tool.labels == region)
        face[inside] = 1 if region == 1 else 2
        face[inside[: int(kept * len(inside))]] = face_of_some
    face[tool.labels == 3] = -1
    paint = (CadFace("plane", colour=(255, 0, 0)), CadFace("plane", colour=(0, 0, 255)), CadFace("freeform"))
    colours = region_colours(tool, ImportedPart(tool.mesh, face, CleaningReport(()), paint))
    assert colours == ((255, 0, 0), (0, 0, 255), *(None,) * (tool.n - 2))
    plain = ImportedPart(tool.mesh, face, CleaningReport(()), (CadFace("plane"),) * 3)
    assert set(region_colours(tool, plain)) == {None}
