"""Core values to bytes and back: NumPy archives with one JSON entry for the words."""

import io
import json
import zipfile
from dataclasses import fields
from typing import Any

import numpy as np

from app.geometry.importing import CleaningReport, ImportedPart
from app.geometry.parsed import cad_faces_from_json, cad_faces_to_json
from app.geometry.tool import Mesh, Region, RegionGraph, Tool

QUICK = 1  # compression level: a tenth larger than the usual 6 and three times as quick, and somebody waits
COORDINATES = "vertices"  # compressed they would be a quarter smaller at best, and take most of the time
MEDIA_TYPE = "application/x-npz"
GRAPH_ARRAYS = tuple(f.name for f in fields(RegionGraph) if f.name != "source")
REGION_WORDS = ("name", "description", "kind")
REGION_NUMBERS = ("area", "curvature")


def pack(words: Any, **arrays: Any) -> bytes:
    """An .npz; the same values give the same bytes."""
    file = io.BytesIO()
    text = np.frombuffer(json.dumps(words).encode(), np.uint8)
    with zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED, compresslevel=QUICK) as archive:
        for name, values in {"words": text, **arrays}.items():
            entry = f"{name}.npy" if name != COORDINATES else zipfile.ZipInfo(f"{name}.npy")  # the latter isn't compressed
            with archive.open(entry, "w", force_zip64=True) as place:
                np.lib.format.write_array(place, np.asanyarray(values), allow_pickle=False)
    return file.getvalue()


def unpack(content: bytes) -> tuple[Any, dict[str, np.ndarray]]:
    """What `pack` was given; never runs code from the file."""
    with np.load(io.BytesIO(content), allow_pickle=False) as archive:
        arrays = {name: archive[name] for name in archive.files}
    return json.loads(arrays.pop("words").tobytes()), arrays


def tool_to_bytes(tool: Tool) -> bytes:
    """A tool as an .npz."""
    words = {
        "source": tool.graph.source,
        "regions": [{k: getattr(r, k) for k in (*REGION_WORDS, *REGION_NUMBERS)} for r in tool.regions],
    }
    return pack(
        words,
        vertices=tool.mesh.vertices,
        faces=tool.mesh.faces,
        labels=tool.labels,
        centroids=np.array([r.centroid for r in tool.regions]).reshape(-1, 3),
        normals=np.array([r.normal for r in tool.regions]).reshape(-1, 3),
        **{f"graph_{name}": getattr(tool.graph, name) for name in GRAPH_ARRAYS},
    )


def tool_from_bytes(content: bytes) -> Tool:
    """The tool that `tool_to_bytes` stored, bit for bit."""
    words, a = unpack(content)
    regions = tuple(
        Region(centroid=c, normal=n, **about) for about, c, n in zip(words["regions"], a["centroids"], a["normals"], strict=True)
    )
    graph = RegionGraph(source=words["source"], **{name: a[f"graph_{name}"] for name in GRAPH_ARRAYS})
    return Tool(Mesh(a["vertices"], a["faces"]), a["labels"], regions, graph)


def part_to_bytes(part: ImportedPart) -> bytes:
    """A cleaned part before segmentation as an .npz."""
    lines = [list(line) for line in part.report.lines]
    return pack(
        {"lines": lines, "cad_faces": cad_faces_to_json(part.cad_faces)},
        vertices=part.mesh.vertices,
        faces=part.mesh.faces,
        cad_face=part.cad_face,
    )


def part_from_bytes(content: bytes) -> ImportedPart:
    """The part that `part_to_bytes` stored."""
    words, a = unpack(content)
    report = CleaningReport(tuple((level, text) for level, text in words["lines"]))
    cad_faces = cad_faces_from_json(words.get("cad_faces", []))
    return ImportedPart(Mesh(a["vertices"], a["faces"]), a["cad_face"], report, cad_faces)
