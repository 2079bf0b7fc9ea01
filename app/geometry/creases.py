"""Sharp edges: triangles on either side get vertices of their own, so that light breaks there."""

import numpy as np
from numpy.typing import NDArray

from app.geometry.cleaning import edge_table, joined
from app.geometry.compiled import kernel
from app.geometry.tool import Mesh

SHARP = np.radians(30)  # between two triangles: the edge is one to the eye too


def creased(mesh: Mesh, labels: NDArray[np.int32]) -> Mesh:
    """The same triangles, with vertices apart along sharp edges and along borders between labels (F,)."""
    edges, side_edge, count = edge_table(mesh.faces)
    faces = np.ascontiguousarray(mesh.faces, np.int64)
    cut, corner, links = _corners_apart(mesh.vertices, faces, labels, edges, side_edge, count, np.cos(SHARP))
    group = joined(links, len(cut))
    vertices = np.empty((len(mesh.vertices) + int(group.max(initial=-1)) + 1, 3))
    vertices[: len(mesh.vertices)] = mesh.vertices
    vertices[len(mesh.vertices) + group] = mesh.vertices[cut]
    faces = faces.ravel()
    apart = corner >= 0
    faces[apart] = len(mesh.vertices) + group[corner[apart]]
    return Mesh(vertices, faces.reshape(-1, 3).astype(np.int32))


@kernel
def _corners_apart(vertices, faces, labels, edges, side_edge, count, least):  # pragma: no cover - compiled
    """Of face corners at vertices that something is cut along: their vertices (C,); the number of each corner 3 f + k, -1 elsewhere
    (3 F,); and pairs of them (L, 2) that meet across an edge that isn't cut."""
    normals = np.empty((len(faces), 3))
    for f in range(len(faces)):
        a, b, c = faces[f, 0], faces[f, 1], faces[f, 2]
        for k in range(3):
            i, j = (k + 1) % 3, (k + 2) % 3
            u, v = vertices[b, i] - vertices[a, i], vertices[c, j] - vertices[a, j]
            x, y = vertices[b, j] - vertices[a, j], vertices[c, i] - vertices[a, i]
            normals[f, k] = u * v - x * y
        size = max(np.sqrt(normals[f, 0] ** 2 + normals[f, 1] ** 2 + normals[f, 2] ** 2), 1e-300)
        for k in range(3):
            normals[f, k] /= size
    beside = np.full((len(count), 2), -1, np.int64)  # the sides, 3 f + k, at each edge
    for f in range(len(faces)):
        for k in range(3):
            edge = side_edge[f, k]
            beside[edge, 1 if beside[edge, 0] >= 0 else 0] = 3 * f + k
    at_cut = np.zeros(len(vertices), np.bool_)
    for edge in range(len(count)):
        f, g = beside[edge, 0] // 3, beside[edge, 1] // 3
        if count[edge] == 2:
            turn = normals[f, 0] * normals[g, 0] + normals[f, 1] * normals[g, 1] + normals[f, 2] * normals[g, 2]
            if turn >= least and labels[f] == labels[g]:
                continue
        beside[edge, 0] = -1
        at_cut[edges[edge, 0]] = at_cut[edges[edge, 1]] = True
    corner, cut, found = np.full(3 * len(faces), -1, np.int64), np.empty(3 * len(faces), np.int64), 0
    for f in range(len(faces)):
        for k in range(3):
            if at_cut[faces[f, k]]:
                corner[3 * f + k], cut[found] = found, faces[f, k]
                found += 1
    links, linked = np.empty((2 * len(count), 2), np.int64), 0
    for edge in range(len(count)):
        if beside[edge, 0] < 0:
            continue
        f, k, g, j = beside[edge, 0] // 3, beside[edge, 0] % 3, beside[edge, 1] // 3, beside[edge, 1] % 3
        for end in range(2):
            here, there = 3 * f + (k + end) % 3, 3 * g + (j + end) % 3
            if faces[f, here % 3] != faces[g, there % 3]:
                there = 3 * g + (j + 1 - end) % 3
            if corner[here] >= 0:
                links[linked, 0], links[linked, 1] = corner[here], corner[there]
                linked += 1
    return cut[:found], corner, links[:linked]
