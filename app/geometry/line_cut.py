"""Cut a region along the shortest line through clicked points; its open ends run on to the nearest border."""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from app.errors import InvalidInput
from app.geometry.cleaning import face_pairs
from app.geometry.editing import Edited, finish_division, name_of
from app.geometry.geodesic import border_edges, shortest_line
from app.geometry.slicing import Integers, Sliced, insert_point, nearest_face, split_edges
from app.geometry.splitting import connected
from app.geometry.tool import Array, Mesh, Tool

FAR = 0.02  # share of the part's diagonal a clicked point may lie off its region
MOST_POINTS = 100


@dataclass(frozen=True)
class DrawnLine:
    """A line on a region that runs along edges of the mesh."""

    mesh: Mesh
    source: Integers  # (F,) face of the tool that each face is a part of
    edges: Integers  # (K, 2) edges of the line, low vertex first
    points: Array  # (K', 3) its points in order, metres


def draw_line(tool: Tool, region: int, points: Array, closed: bool = False) -> DrawnLine:
    """The shortest line on a region through `points` (K, 3), metres.

    Raises:
        InvalidInput: Too few points, or points off the region.
    """
    if not (3 if closed else 2) <= len(points) <= MOST_POINTS:
        raise InvalidInput(f"A line needs {3 if closed else 2} to {MOST_POINTS} points; {len(points)} were given.")
    mesh, source = tool.mesh, np.arange(len(tool.mesh.faces))
    stops: list[int] = []
    for point in points:
        face = _under(tool, mesh, tool.labels[source], region, point)
        sliced = insert_point(mesh, face, point)
        mesh, source = sliced.mesh, source[sliced.source]
        stops.append(int(sliced.vertices[0]))
    stops = [v for v, before in zip(stops, [-1, *stops], strict=False) if v != before]
    if len(stops) < 2:
        raise InvalidInput("The points of the line lie in one place; choose points that are apart.")
    legs = _legs(mesh, tool.labels[source] == region, stops, closed)
    edges = np.empty((0, 2), np.int64)
    drawn: list[Array] = []
    for start, goal in legs:
        inside = np.flatnonzero(tool.labels[source] == region)
        line = shortest_line(mesh, inside, start, goal)
        if line is None:
            raise InvalidInput(f"The line has no way from point to point inside {name_of(tool, region)}.")
        loose = line.ends[:, 0] != line.ends[:, 1]
        sliced = split_edges(mesh, line.ends[loose], line.along[loose])
        edges = _after_split(edges, line.ends[loose], sliced.vertices)
        nodes = line.ends[:, 0].copy()
        nodes[loose] = sliced.vertices
        edges = np.concatenate([edges, np.sort(np.stack([nodes[:-1], nodes[1:]], axis=1), axis=1)])
        mesh, source = sliced.mesh, source[sliced.source]
        drawn.append(mesh.vertices[nodes])
    if not closed:  # the first leg runs from the first point to the border
        drawn = [drawn[0][::-1], *drawn[1:]] if legs[0][1] is None else drawn
    return DrawnLine(mesh, source, edges, np.concatenate(drawn))


def cut_along_line(tool: Tool, region: int, points: Array, closed: bool = False) -> Edited:
    """Divide a region along the line through `points`.

    Raises:
        InvalidInput: The line doesn't divide it.
    """
    line = draw_line(tool, region, points, closed)
    labels = tool.labels[line.source].astype(np.int64)
    inside = np.flatnonzero(labels == region)
    faces = line.mesh.faces[inside].astype(np.int64)
    pairs = face_pairs(faces)
    crossing = _over_edges(faces, pairs, line.edges, len(line.mesh.vertices))
    piece = connected(np.zeros(len(inside), np.int64), pairs[~crossing])
    side = np.full(len(labels), -1, np.int64)
    side[inside] = piece
    sliced = Sliced(line.mesh, line.source, np.empty(0, np.int64))
    return finish_division(tool, sliced, labels, region, side, "The line")


def _under(tool: Tool, mesh: Mesh, labels: NDArray[np.int32], region: int, point: Array) -> int:
    face, distance = nearest_face(mesh, point, np.flatnonzero(labels == region))
    if distance > FAR * float(np.linalg.norm(np.ptp(mesh.vertices, axis=0))):
        raise InvalidInput(f"A point of the line doesn't lie on {name_of(tool, region)}. All its points have to be on one region.")
    return face


def _legs(mesh: Mesh, inside: NDArray[np.bool_], stops: list[int], closed: bool) -> list[tuple[int, int | None]]:
    """From where to where the line runs; None: to the border."""
    between: list[tuple[int, int | None]] = list(pairwise(stops))
    if closed:
        return [*between, (stops[-1], stops[0])]
    on_border = {v for edge in border_edges(mesh.faces[inside]) for v in edge}
    first: list[tuple[int, int | None]] = [] if stops[0] in on_border else [(stops[0], None)]
    last: list[tuple[int, int | None]] = [] if stops[-1] in on_border else [(stops[-1], None)]
    return first + between + last


def _after_split(edges: Integers, split: Integers, middle: Integers) -> Integers:
    """The edges of a line after some edges of the mesh were split in two."""
    if len(edges) == 0 or len(split) == 0:
        return edges
    at = {(int(min(pair)), int(max(pair))): int(m) for pair, m in zip(split, middle, strict=True)}
    result: list[tuple[int, int]] = []
    for low, high in edges.tolist():
        m = at.get((low, high))
        result += [(low, high)] if m is None else [(low, m), (high, m)]  # new vertices have the highest numbers
    return np.array(result)


def _over_edges(faces: Integers, pairs: Integers, edges: Integers, total: int) -> NDArray[np.bool_]:
    """Pairs of faces (P,) whose common edge is one of `edges`."""
    first, second = faces[pairs[:, 0]], faces[pairs[:, 1]]
    common = (first[:, :, None] == second[:, None, :]).any(axis=2)
    corner = np.argsort(~common, axis=1, kind="stable")[:, :2]
    ends = np.sort(np.take_along_axis(first, corner, axis=1), axis=1)
    return np.isin(ends[:, 0] * total + ends[:, 1], edges[:, 0] * total + edges[:, 1])
