"""Turn parsed triangles into one welded, consistently wound surface, and say what was done to it."""

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components
from scipy.spatial import KDTree

from app.errors import TooLarge, UnreadableMesh
from app.geometry.tool import Array

Level = Literal["info", "repaired", "warning"]
Integers = NDArray[np.int64]

WELD = 1e-6  # share of the diagonal within which two vertices are one
FLAT = 1e-12  # share of the squared diagonal below which a triangle has no area
MOST_FACES = 2_000_000
LEAST_CONNECTED = 0.5  # share of triangles that must touch another one along an edge


@dataclass(frozen=True)
class CleaningReport:
    """What was found and done, in plain sentences."""

    lines: tuple[tuple[str, str], ...]  # (level "info" | "repaired" | "warning", sentence)


@dataclass(frozen=True)
class RawSurface:
    """Triangles as the parser gave them."""

    vertices: Array  # (V, 3) file units
    faces: Integers  # (F, 3)
    cad_face: Integers  # (F,) id of the CAD face, -1 without


@dataclass(frozen=True)
class CleanSurface:
    """One connected, welded surface."""

    vertices: Array  # (V, 3) file units
    faces: Integers  # (F, 3)
    cad_face: Integers  # (F,)
    closed: bool
    lines: tuple[tuple[Level, str], ...]


def clean(raw: RawSurface) -> CleanSurface:
    """Weld, drop useless triangles, keep the largest connected piece, and make all triangles face the same way.

    Raises:
        UnreadableMesh: No triangles, coordinates that are not numbers, or triangles that don't hang together.
        TooLarge: More than MOST_FACES triangles.
    """
    _refuse_hopeless(raw)
    lines: list[tuple[Level, str]] = []
    vertices, faces = weld(raw.vertices, raw.faces)
    if len(vertices) < len(raw.vertices):
        lines.append(("info", f"Joined {len(raw.vertices) - len(vertices):,} doubled corner points."))
    faces, cad_face = _drop_useless(vertices, faces, raw.cad_face, lines)
    _refuse_soup(faces)
    faces, cad_face = _keep_largest(vertices, faces, cad_face, lines)
    vertices, faces = _compact(vertices, faces)
    faces, closed = _orient(vertices, faces, lines)
    return CleanSurface(vertices, faces, cad_face, closed, tuple(lines))


def _refuse_hopeless(raw: RawSurface) -> None:
    if len(raw.faces) == 0:
        raise UnreadableMesh("The file holds no triangles. Export a solid or a surface, not only lines or points.")
    if len(raw.faces) > MOST_FACES:
        raise TooLarge(f"The file holds {len(raw.faces):,} triangles; at most {MOST_FACES:,} are accepted. Export it more coarsely.")
    if raw.faces.min() < 0 or raw.faces.max() >= len(raw.vertices):
        raise UnreadableMesh("A triangle refers to a corner point that is not in the file. The file is damaged; export it again.")
    used = raw.vertices[np.unique(raw.faces)]
    if not np.isfinite(used).all():
        bad = int((~np.isfinite(used)).any(axis=1).sum())
        raise UnreadableMesh(f"{bad:,} corner points have coordinates that are not numbers (NaN or infinite). Export the part again.")
    if not np.ptp(used, axis=0).max() > 0:
        raise UnreadableMesh("All corner points lie in one place: the part has no size.")


def weld(vertices: Array, faces: Integers) -> tuple[Array, Integers]:
    """Join vertices closer than WELD times the diagonal; the first of each group stays where it is."""
    used = np.unique(faces)
    diagonal = float(np.linalg.norm(np.ptp(vertices[used], axis=0)))
    exact, first, inverse = np.unique(vertices, axis=0, return_index=True, return_inverse=True)
    pairs = KDTree(exact).query_pairs(WELD * diagonal, output_type="ndarray") if np.isfinite(exact).all() else np.empty((0, 2), int)
    graph = coo_matrix((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), shape=(len(exact), len(exact)))
    _, group = connected_components(graph, directed=False)
    _, representative = np.unique(group, return_index=True)
    return vertices[first[representative]], group[inverse.ravel()][faces].astype(np.int64)


def _drop_useless(vertices: Array, faces: Integers, cad_face: Integers, lines: list[tuple[Level, str]]) -> tuple[Integers, Integers]:
    """Remove triangles without area and second copies."""
    collapsed = (faces == np.roll(faces, 1, axis=1)).any(axis=1)
    diagonal2 = float(np.sum(np.ptp(vertices, axis=0) ** 2))
    corners = vertices[faces]
    twice = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    keep = ~collapsed & (twice > FLAT * diagonal2)
    if (~keep).any():
        lines.append(("repaired", f"Removed {int((~keep).sum()):,} triangles without area."))
    faces, cad_face = faces[keep], cad_face[keep]
    if len(faces) == 0:
        raise UnreadableMesh("No triangle in the file has an area. Export a solid or a surface.")
    _, first = np.unique(np.sort(faces, axis=1), axis=0, return_index=True)
    if len(first) < len(faces):
        lines.append(("repaired", f"Removed {len(faces) - len(first):,} doubled triangles."))
        first.sort()
        faces, cad_face = faces[first], cad_face[first]
    return faces, cad_face


def edge_table(faces: NDArray[np.integer]) -> tuple[Integers, Integers, Integers]:
    """Edges (E, 2) sorted, the edge of each face side (F, 3), and the number of faces at each edge (E,)."""
    sides = np.sort(np.stack([faces, np.roll(faces, -1, axis=1)], axis=-1).reshape(-1, 2).astype(np.int64), axis=1)
    n = int(faces.max()) + 1
    key, inverse, count = np.unique(sides[:, 0] * n + sides[:, 1], return_inverse=True, return_counts=True)
    return np.stack([key // n, key % n], axis=1), inverse.reshape(-1, 3), count


def face_pairs(faces: NDArray[np.integer]) -> Integers:
    """Pairs of faces (P, 2) that share an edge with exactly two faces."""
    _, side_edge, count = edge_table(faces)
    flat = side_edge.ravel()
    order = np.argsort(flat, kind="stable")
    order = order[count[flat[order]] == 2]
    return (order // 3).reshape(-1, 2)


def _refuse_soup(faces: Integers) -> None:
    _, side_edge, count = edge_table(faces)
    connected = (count[side_edge] >= 2).any(axis=1).mean()
    if len(faces) > 1 and connected < LEAST_CONNECTED:
        raise UnreadableMesh(
            f"The {len(faces):,} triangles don't form a surface: only {100 * connected:.0f} % of them touch another triangle "
            "along an edge. Export the part as one connected solid or surface."
        )


def components(faces: Integers) -> Integers:
    """Connected piece of each face (any shared edge counts), numbered from 0."""
    _, side_edge, count = edge_table(faces)
    rows = np.repeat(np.arange(len(faces)), 3)
    size = len(faces) + len(count)
    graph = coo_matrix((np.ones(len(rows)), (rows, len(faces) + side_edge.ravel())), shape=(size, size))
    _, group = connected_components(graph, directed=False)
    return np.unique(group[: len(faces)], return_inverse=True)[1].ravel()


def areas(vertices: Array, faces: NDArray[np.integer]) -> Array:
    """Area of each face (F,)."""
    corners = vertices[faces]
    return np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1) / 2


def _keep_largest(vertices: Array, faces: Integers, cad_face: Integers, lines: list[tuple[Level, str]]) -> tuple[Integers, Integers]:
    """A tool is one connected surface: the piece with the largest area stays, the others are named in the report."""
    piece = components(faces)
    if piece.max() == 0:
        return faces, cad_face
    area = np.bincount(piece, weights=areas(vertices, faces))
    largest = int(np.argmax(area))
    share = 100 * (1 - area[largest] / area.sum())
    lines.append(("warning", f"Kept the largest of {len(area):,} separate bodies and left out the others ({share:.1f} % of the area)."))
    keep = piece == largest
    return faces[keep], cad_face[keep]


def _compact(vertices: Array, faces: Integers) -> tuple[Array, Integers]:
    used, inverse = np.unique(faces, return_inverse=True)
    return vertices[used], inverse.reshape(-1, 3)


def _orient(vertices: Array, faces: Integers, lines: list[tuple[Level, str]]) -> tuple[Integers, bool]:
    """Make neighbouring faces agree, closed surfaces face outward, and report the borders."""
    flip = _disagreeing(faces)
    if flip is None:
        lines.append(("warning", "The surface has only one side (like a Moebius strip); inside and outside can't be told apart."))
    elif flip.any():
        flip = flip if flip.mean() <= 0.5 else ~flip
        faces = np.where(flip[:, None], faces[:, ::-1], faces)
        lines.append(("repaired", f"Turned {int(flip.sum()):,} triangles that faced the wrong way."))
    _, _, count = edge_table(faces)
    border, crowded = int((count == 1).sum()), int((count > 2).sum())
    if crowded:
        lines.append(("warning", f"{crowded:,} edges are shared by more than two triangles; regions end there."))
    if border:
        lines.append(("warning", f"The surface is open: {border:,} edges belong to one triangle only."))
    else:
        lines.append(("info", "The surface is closed."))
        corners = vertices[faces] - vertices.mean(axis=0)
        if np.einsum("ij,ij->", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])) < 0:
            faces = faces[:, ::-1]
            lines.append(("repaired", "Turned the surface inside out: all triangles faced inward."))
    return faces, border == 0


def _disagreeing(faces: Integers) -> NDArray[np.bool_] | None:
    """Faces to flip so that all neighbours agree (None: impossible).

    Two copies of every face, as it is and flipped, are joined where they agree; copies in the piece of the first face's
    unflipped copy are right.
    """
    pairs = face_pairs(faces)
    n = len(faces)
    direction = np.stack([faces, np.roll(faces, -1, axis=1)], axis=-1)  # (F, 3, 2)
    _, side_edge, count = edge_table(faces)
    flat = side_edge.ravel()
    order = np.argsort(flat, kind="stable")
    order = order[count[flat[order]] == 2].reshape(-1, 2)
    forward = (direction[..., 0] < direction[..., 1]).ravel()
    agree = forward[order[:, 0]] != forward[order[:, 1]]
    if agree.all():
        return np.zeros(n, bool)
    a, b = pairs[:, 0], pairs[:, 1]
    rows = np.concatenate([a, a + n])
    cols = np.concatenate([np.where(agree, b, b + n), np.where(agree, b + n, b)])
    _, group = connected_components(coo_matrix((np.ones(len(rows)), (rows, cols)), shape=(2 * n, 2 * n)), directed=False)
    if (group[:n] == group[n:]).any():
        return None
    # per piece of the surface, the copy that needs fewer flips
    partner = np.minimum(group[:n], group[n:])
    in_first = group[:n] == partner
    votes = np.bincount(partner, weights=np.where(in_first, 1.0, -1.0), minlength=int(group.max()) + 1)
    return in_first != (votes[partner] >= 0)
