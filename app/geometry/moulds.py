"""Ten parametric layup moulds that ship as the sample project, built from planes, cylinders, spheres and fillets.

Most are translational surfaces: a profile in x-z (lines and arcs) carried along a profile in y-z. Region borders lie on
mesh edges, so the labels are exact. Six moulds are for teaching and four are held back, like D_syn in the paper (Sec. VI).
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from app.geometry.tool import Array, Mesh

BASE_THICKNESS = 0.03  # m of solid below the lowest point of the surface
LINE_STEPS, ARC_STEP = 5, np.radians(7.5)


@dataclass(frozen=True)
class Mould:
    """One sample tool."""

    name: str
    mesh: Mesh  # closed solid, metres, +Z up
    labels: NDArray[np.int32]  # (F,) region of each face, -1 on the sides and the bottom
    split: Literal["train", "test"]


@dataclass(frozen=True)
class Piece:
    """A line or a circular arc of a profile."""

    band: int  # region column (or row) it belongs to
    length: float  # m along the curve
    turn: float = 0.0  # rad turned to the left along it, 0 for a line


@dataclass(frozen=True)
class Profile:
    """A sampled planar curve."""

    points: Array  # (K, 2) horizontal and vertical position, m
    bands: NDArray[np.int32]  # (K - 1,) band of each interval


def trace(pieces: tuple[Piece, ...], heading: float = 0.0) -> Profile:
    """Walk along the pieces from the origin, starting in the direction `heading` (rad above horizontal)."""
    points, bands, here = [np.zeros(2)], [], np.zeros(2)
    for piece in pieces:
        steps = max(LINE_STEPS if piece.turn == 0 else 4, int(np.ceil(abs(piece.turn) / ARC_STEP)))
        for k in range(1, steps + 1):
            points.append(here + _chord(heading, piece.length * k / steps, piece.turn * k / steps))
            bands.append(piece.band)
        here, heading = points[-1], heading + piece.turn
    centred = np.array(points)
    centred[:, 0] -= (centred[0, 0] + centred[-1, 0]) / 2
    return Profile(centred, np.array(bands, np.int32))


def _chord(heading: float, length: float, turn: float) -> Array:
    """End of an arc that starts at the origin; a line when it does not turn."""
    chord = length if turn == 0 else length * np.sin(turn / 2) / (turn / 2)
    return chord * np.array([np.cos(heading + turn / 2), np.sin(heading + turn / 2)])


def straight(length: float, bands: int) -> Profile:
    """A level line cut into equal bands."""
    return trace(tuple(Piece(k, length / bands) for k in range(bands)))


def arc(length: float, bands: int, turn: float) -> Profile:
    """A circular arc cut into equal bands, symmetric about the vertical; `turn` < 0 is a crown, > 0 a trough."""
    return trace(tuple(Piece(k, length / bands, turn / bands) for k in range(bands)), heading=-turn / 2)


def translational(across: Profile, along: Profile) -> tuple[Array, NDArray[np.int32]]:
    """Grid of points (U, V, 3) of `across` carried along `along`, and the label of each cell (U - 1, V - 1)."""
    x, y = across.points[:, 0], along.points[:, 0]
    z = across.points[:, 1][:, None] + along.points[:, 1][None, :]
    grid = np.stack([np.repeat(x[:, None], len(y), 1), np.repeat(y[None, :], len(x), 0), z], axis=-1)
    rows = int(along.bands.max()) + 1
    return grid, (across.bands[:, None] * rows + along.bands[None, :]).astype(np.int32)


def sphere_patch(width: float, depth: float, radius: float, columns: int, rows: int) -> tuple[Array, NDArray[np.int32]]:
    """Crown of a sphere over a rectangle."""
    x, y = straight(width, columns), straight(depth, rows)
    grid, cells = translational(x, y)
    grid[..., 2] = np.sqrt(radius**2 - grid[..., 0] ** 2 - grid[..., 1] ** 2) - radius
    return grid, cells


def solid(grid: Array, cells: NDArray[np.int32], tilt: float = 0.0) -> tuple[Mesh, NDArray[np.int32]]:
    """Close a grid surface with sides and a bottom; `tilt` (rad) leans the surface about y first."""
    turn = np.array([[np.cos(tilt), 0, np.sin(tilt)], [0, 1, 0], [-np.sin(tilt), 0, np.cos(tilt)]])
    grid = grid @ turn.T
    u, v = grid.shape[:2]
    index = np.arange(u * v).reshape(u, v)
    a, b, c, d = index[:-1, :-1], index[1:, :-1], index[1:, 1:], index[:-1, 1:]
    faces = np.stack([np.stack([a, b, c], -1), np.stack([a, c, d], -1)], axis=2).reshape(-1, 3)
    loop = np.concatenate([index[:-1, 0], index[-1, :-1], index[:0:-1, -1], index[0, :0:-1]])
    return close(grid.reshape(-1, 3), faces, np.repeat(cells.ravel(), 2), loop)


def close(vertices: Array, faces: NDArray[np.int64], labels: NDArray[np.int32], loop: NDArray[np.int64]) -> tuple[Mesh, NDArray[np.int32]]:
    """Add side walls and a flat bottom below an open surface whose border is `loop` (counter-clockwise from above)."""
    vertices = vertices - [0, 0, vertices[:, 2].min() - BASE_THICKNESS]
    n, k = len(vertices), len(loop)
    foot = vertices[loop] * [1, 1, 0]
    middle = np.array([[foot[:, 0].mean(), foot[:, 1].mean(), 0]])
    low, following = n + np.arange(k), n + (np.arange(k) + 1) % k
    upper_next = np.roll(loop, -1)
    sides = np.concatenate([np.stack([loop, low, upper_next], 1), np.stack([upper_next, low, following], 1)])
    bottom = np.stack([np.full(k, n + k), following, low], 1)
    everything = np.concatenate([faces, sides, bottom]).astype(np.int32)
    outside = np.full(len(sides) + len(bottom), -1, np.int32)
    return Mesh(np.concatenate([vertices, foot, middle]), everything), np.concatenate([labels, outside]).astype(np.int32)


def dish(side: float, radius: float, opening: float, fillet: float) -> tuple[Mesh, NDArray[np.int32]]:
    """A square plate with a spherical pocket: ball of `radius`, filleted into the plate, `opening` m to the fillet's end.

    Regions: the pocket's bottom, four quarters of its wall, four quarters of the rim.
    """
    # the fillet's centre circle touches the sphere from outside (radius + fillet) and the plate from below
    lift = np.sqrt((radius + fillet) ** 2 - opening**2) - fillet  # height of the sphere's centre above the plate
    join = np.arctan2(opening, lift + fillet)  # polar angle where ball and fillet meet
    ball = np.linspace(0, join, 13)
    bend = np.linspace(join, 0, 6)[1:]
    r = np.concatenate([radius * np.sin(ball), opening - fillet * np.sin(bend)])
    z = np.concatenate([lift - radius * np.cos(ball), -fillet + fillet * np.cos(bend)])
    band = np.concatenate([np.where(np.arange(12) < 6, 0, 1), np.ones(5, int)])
    sectors = 48
    angle = 2 * np.pi * np.arange(sectors) / sectors
    to_edge = side / 2 / np.maximum(np.abs(np.cos(angle)), np.abs(np.sin(angle)))
    rings = [np.stack([ri * np.cos(angle), ri * np.sin(angle), np.full(sectors, zi)], 1) for ri, zi in zip(r[1:], z[1:], strict=True)]
    for t in np.linspace(0, 1, 6)[1:]:
        ri = opening * (1 - t) + to_edge * t
        rings.append(np.stack([ri * np.cos(angle), ri * np.sin(angle), np.zeros(sectors)], 1))
    band = np.concatenate([band, np.full(5, 2)])
    vertices = np.concatenate([[[0, 0, z[0]]], *rings])
    quarter = ((np.arange(sectors) - sectors // 8) // (sectors // 4)) % 4
    faces, labels = [], []
    for k, which in enumerate(band):
        for j in range(sectors):
            i = (j + 1) % sectors
            label = 0 if which == 0 else 1 + 4 * (int(which) - 1) + int(quarter[j])
            outer, outer_next = 1 + k * sectors + j, 1 + k * sectors + i
            inner, inner_next = (0, 0) if k == 0 else (outer - sectors, outer_next - sectors)
            faces.append([inner, outer, outer_next])
            labels.append(label)
            if k:
                faces.append([inner, outer_next, inner_next])
                labels.append(label)
    loop = 1 + (len(rings) - 1) * sectors + np.arange(sectors)
    return close(vertices, np.array(faces), np.array(labels, np.int32), loop)


def _bend() -> tuple[Mesh, NDArray[np.int32]]:
    """A flange: plane, fillet, sloping plane."""
    across = trace((Piece(0, 0.15), Piece(1, 0.09, np.radians(48)), Piece(2, 0.14)))
    return solid(*translational(across, straight(0.44, 4)))


def _barrel() -> tuple[Mesh, NDArray[np.int32]]:
    """Single curvature, convex, leaning to one side."""
    return solid(*translational(arc(0.40, 3, np.radians(-85)), straight(0.46, 4)), tilt=np.radians(8))


def _step() -> tuple[Mesh, NDArray[np.int32]]:
    """A joggle: plane, concave fillet, wall, convex fillet, plane."""
    across = trace((Piece(0, 0.14), Piece(1, 0.05, np.radians(55)), Piece(1, 0.03), Piece(1, 0.05, np.radians(-55)), Piece(2, 0.15)))
    return solid(*translational(across, straight(0.42, 4)))


def _ribbed() -> tuple[Mesh, NDArray[np.int32]]:
    """A plate with one rounded rib, filleted on both sides."""
    rib = np.radians(50)
    foot, crown = Piece(1, 0.035, rib), Piece(1, 0.10, -2 * rib)
    across = trace((Piece(0, 0.12), foot, crown, foot, Piece(2, 0.12)))
    return solid(*translational(across, straight(0.40, 3)))


def _saddle() -> tuple[Mesh, NDArray[np.int32]]:
    """Double curvature of opposite signs."""
    return solid(*translational(arc(0.38, 3, np.radians(60)), arc(0.46, 4, np.radians(-70))))


def _trough() -> tuple[Mesh, NDArray[np.int32]]:
    """A concave cylinder between two level lips."""
    lip, ease = Piece(0, 0.06), Piece(0, 0.03, np.radians(-40))
    across = trace((lip, ease, Piece(1, 0.22, np.radians(80)), Piece(2, 0.03, np.radians(-40)), Piece(2, 0.06)))
    return solid(*translational(across, straight(0.48, 4)), tilt=np.radians(-6))


def _dome() -> tuple[Mesh, NDArray[np.int32]]:
    """The crown of a sphere."""
    return solid(*sphere_patch(0.38, 0.44, 0.36, 3, 4))


def _dish() -> tuple[Mesh, NDArray[np.int32]]:
    """A concave pocket in a plate."""
    return dish(0.42, 0.20, 0.15, 0.05)


def _hood() -> tuple[Mesh, NDArray[np.int32]]:
    """Convex in both directions, with a plane flange along one side."""
    across = trace((Piece(0, 0.12), Piece(1, 0.06, np.radians(40)), Piece(2, 0.24, np.radians(-70))))
    return solid(*translational(across, arc(0.42, 4, np.radians(-45))))


def _channel() -> tuple[Mesh, NDArray[np.int32]]:
    """A U section: floor between two fillets and two steep walls."""
    bend = np.radians(60)
    across = trace((Piece(0, 0.10), Piece(0, 0.05, bend), Piece(1, 0.14), Piece(2, 0.05, bend), Piece(2, 0.10)), heading=-bend)
    return solid(*translational(across, straight(0.46, 4)), tilt=np.radians(5))


_BUILDERS: tuple[tuple[str, Literal["train", "test"], Callable[[], tuple[Mesh, NDArray[np.int32]]]], ...] = (
    ("Bend 01", "train", _bend), ("Barrel 02", "train", _barrel), ("Step 03", "train", _step),
    ("Ribbed 04", "train", _ribbed), ("Saddle 05", "train", _saddle), ("Trough 06", "train", _trough),
    ("Dome 07", "test", _dome), ("Dish 08", "test", _dish), ("Hood 09", "test", _hood), ("Channel 10", "test", _channel),
)  # fmt: skip


def sample_moulds() -> tuple[Mould, ...]:
    """The ten sample tools, in order."""
    return tuple(Mould(name, *build(), split) for name, split, build in _BUILDERS)
