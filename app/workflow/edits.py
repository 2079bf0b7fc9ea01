"""What an edit of a tool's regions is: its fields checked, applied to the tool, and told in words."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from app.errors import InvalidInput
from app.geometry import editing
from app.geometry.editing import Edited
from app.geometry.grid import grid_size, grid_split
from app.geometry.line_cut import cut_along_line
from app.geometry.merge_tree import Integers, MergeTree
from app.geometry.pieces import piece_under
from app.geometry.slicing import Sliced, nearest_face
from app.geometry.splitting import Surface
from app.geometry.tool import Array, Mesh, Tool

Json = dict[str, Any]

MOST_REGIONS = 100
MOST_NAME = 40


@dataclass(frozen=True)
class Before:
    """A tool as it is before an edit."""

    tool: Tool
    locked: tuple[int, ...]
    hidden: tuple[int, ...]
    tool_sha: str
    tree: Callable[[], MergeTree]  # of the tool's triangles; takes a moment the first time


@dataclass(frozen=True)
class After:
    """A tool after an edit; `kept` says which region of before each one still is (-1: a new one)."""

    tool: Tool
    kept: tuple[int, ...]
    locked: tuple[int, ...]
    hidden: tuple[int, ...]
    words: str
    source: Integers | None = None  # (F,) face of before that each face is a part of; None when that isn't known

    @property
    def made(self) -> list[int]:
        """Regions that are new or changed."""
        return [region for region, old in enumerate(self.kept) if old < 0]


def apply(before: Before, edit: Json) -> After:
    """Carry out an edit.

    Raises:
        InvalidInput: It names what isn't there, can't be done, or would change a locked region.
    """
    regions = [*edit.get("regions", []), *([edit["region"]] if edit.get("region") is not None else [])]
    for region in regions:
        if not 0 <= region < before.tool.n:
            raise InvalidInput(f"There is no region {region}; this tool has {before.tool.n}, numbered from 0.")
    return KINDS[edit["kind"]](before, edit)


def _shaped(before: Before, edited: Edited, words: str | Callable[[Edited], str]) -> After:
    """The outcome of an edit that changes regions.

    Raises:
        InvalidInput: It would change a locked region.
    """
    held = [a for a in edited.changed if a in before.locked]
    if held:
        raise InvalidInput(f"{names_of(before.tool, held)} {'is' if len(held) == 1 else 'are'} locked. Unlock to change.")
    if edited.tool.n > MOST_REGIONS:
        raise InvalidInput(f"This would make {edited.tool.n} regions; a tool has at most {MOST_REGIONS}.")
    kept = tuple(int(a) for a in edited.kept)
    locked, hidden = (tuple(new for new, old in enumerate(kept) if old in marked) for marked in (before.locked, before.hidden))
    return After(edited.tool, kept, locked, hidden, words if isinstance(words, str) else words(edited), edited.source)


def _merge(before: Before, edit: Json) -> After:
    regions = sorted(set(edit.get("regions", [])))
    edited = editing.merge(before.tool, regions)
    return _shaped(before, edited, f"Merged {names_of(before.tool, regions)}")


def _split_plane(before: Before, edit: Json) -> After:
    region = _one_region(edit)
    points = edit.get("points_mm")
    if points is not None:
        if len(points) != 2:
            raise InvalidInput("A plane is put through two points, or through one with a direction.")
        first, second = metres(points)
        point, normal = first, editing.upright_plane(before.tool, region, first, second)
    elif edit.get("point_mm") is not None and edit.get("normal") is not None:
        point, normal = metres([edit["point_mm"]])[0], np.array(edit["normal"], float)
    else:
        raise InvalidInput("A plane needs points_mm with two points, or point_mm and normal.")
    edited = editing.split_by_plane(before.tool, region, point, normal)
    return _shaped(before, edited, f"Divided {names_of(before.tool, [region])} by a plane")


def _split_grid(before: Before, edit: Json) -> After:
    tool, regions = before.tool, sorted(set(edit.get("regions", [])))
    if not regions:
        raise InvalidInput("Select the regions to divide.")
    rows, columns = _grid(tool, regions, edit)
    if rows * columns < 2:
        raise InvalidInput("A grid of one cell divides nothing; choose more rows or columns, or smaller cells.")
    made = grid_split(_surface(tool), regions, rows, columns)
    sliced = Sliced(Mesh(made.vertices, made.faces.astype(np.int32)), made.source, np.empty(0, np.int64))
    edited = editing.finish(tool, sliced, made.labels)
    if not edited.changed:
        raise InvalidInput(f"{names_of(tool, regions)} can't be divided into {rows} x {columns}: the cells would be too small.")
    return _shaped(before, edited, f"Divided {names_of(tool, regions)} into {rows} x {columns}")


def _grid(tool: Tool, regions: list[int], edit: Json) -> tuple[int, int]:
    """Rows and columns, as given or after the size of a cell."""
    if edit.get("rows") is not None or edit.get("columns") is not None:
        return edit.get("rows") or 1, edit.get("columns") or 1
    if edit.get("size_mm") is None:
        raise InvalidInput("A grid needs rows and columns, or the size of a cell (size_mm).")
    area = sum(tool.regions[a].area for a in regions)
    cells = max(1, round(area / (edit["size_mm"] * 1e-3) ** 2))
    return grid_size(_surface(tool), regions, cells, edit.get("aspect") or 1.0)


def _surface(tool: Tool) -> Surface:
    faces = tool.mesh.faces.astype(np.int64)
    none = np.full(len(faces), -1, np.int32)
    return Surface(tool.mesh.vertices, faces, none, tool.labels.astype(np.int64), np.arange(len(faces)))


def _cut(before: Before, edit: Json) -> After:
    region = _one_region(edit)
    edited = cut_along_line(before.tool, region, metres(edit.get("path_mm") or []), bool(edit.get("closed")))
    return _shaped(before, edited, f"Cut {names_of(before.tool, [region])} along a line")


def _reassign(before: Before, edit: Json) -> After:
    tool = before.tool
    if edit.get("point_mm") is None:
        raise InvalidInput("Moving a piece needs the point that was clicked (point_mm).")
    piece = piece_under(tool, before.tree(), metres([edit["point_mm"]])[0], edit.get("level") or 1)
    if piece.region is None:
        raise InvalidInput("This place is not on a region. Add it to the working surface first.")
    wish = edit.get("to")
    if wish is None and piece.to is None:
        raise InvalidInput("This piece touches no other region. Make it a region of its own, or choose a larger piece.")
    to = None if wish == "new" else piece.to if wish is None else int(wish)
    if to is not None and not 0 <= to < tool.n:
        raise InvalidInput(f"There is no region {to}; this tool has {tool.n}, numbered from 0.")
    if to is not None and to == piece.region:
        raise InvalidInput(f"This piece belongs to {names_of(tool, [to])} already.")
    edited = editing.move_piece(tool, piece.faces, to)
    here = names_of(tool, [piece.region])
    if to is None:
        return _shaped(before, edited, lambda e: f"Made a piece of {here} a region of its own ({e.tool.regions[-1].name})")
    return _shaped(before, edited, f"Gave a piece of {here} to {names_of(tool, [to])}")


def _working(before: Before, edit: Json) -> After:
    tool, points = before.tool, edit.get("points_mm") or []
    if edit.get("on") is None:
        raise InvalidInput("Say whether to add to the working surface (on: true) or to take from it (on: false).")
    if not edit["on"]:
        clicked = [int(tool.labels[nearest_face(tool.mesh, point)[0]]) for point in metres(points)]
        regions = sorted({*edit.get("regions", []), *(a for a in clicked if a >= 0)})
        if not regions:
            raise InvalidInput("Select the regions to take from the working surface.")
        return _shaped(before, editing.take_off(tool, regions), f"Took {names_of(tool, regions)} from the working surface")
    if not points:
        raise InvalidInput("Click the places to add to the working surface (points_mm).")
    patch = np.zeros(len(tool.labels), bool)
    for point in metres(points):
        piece = piece_under(tool, before.tree(), point, edit.get("level") or 1)
        if piece.region is not None:
            raise InvalidInput(f"This place belongs to {names_of(tool, [piece.region])}, so it is in the working surface already.")
        patch |= piece.faces
    return _shaped(before, editing.add_patch(tool, patch), lambda e: f"Added {names_of(e.tool, new_of(e))} to the working surface")


def _lock(before: Before, edit: Json) -> After:
    return _marked(before, edit, "locked", ("Locked", "Unlocked"))


def _hide(before: Before, edit: Json) -> After:
    return _marked(before, edit, "hidden", ("Hid", "Showed"))


def _marked(before: Before, edit: Json, field: str, words: tuple[str, str]) -> After:
    regions = sorted(set(edit.get("regions", [])))
    if not regions or edit.get("on") is None:
        raise InvalidInput("Select regions, and say on: true or on: false.")
    marked = set(getattr(before, field))
    marked = marked | set(regions) if edit["on"] else marked - set(regions)
    text = f"{words[0] if edit['on'] else words[1]} {names_of(before.tool, regions)}"
    plain = After(before.tool, tuple(range(before.tool.n)), before.locked, before.hidden, text)
    return replace(plain, **{field: tuple(sorted(marked))})


def _rename(before: Before, edit: Json) -> After:
    tool, region, name = before.tool, _one_region(edit), str(edit.get("name") or "").strip()
    if not 1 <= len(name) <= MOST_NAME:
        raise InvalidInput(f"A region's name has 1 to {MOST_NAME} characters.")
    if name in [r.name for a, r in enumerate(tool.regions) if a != region]:
        raise InvalidInput(f"Another region is called {name}; every region has a name of its own.")
    regions = tuple(replace(r, name=name) if a == region else r for a, r in enumerate(tool.regions))
    renamed = replace(tool, regions=regions)
    return After(renamed, tuple(range(tool.n)), before.locked, before.hidden, f"Renamed {tool.regions[region].name} to {name}")


KINDS: dict[str, Callable[[Before, Json], After]] = {
    "merge": _merge,
    "split_plane": _split_plane,
    "split_grid": _split_grid,
    "cut": _cut,
    "reassign": _reassign,
    "working": _working,
    "lock": _lock,
    "hide": _hide,
    "rename": _rename,
}
SAME_REGIONS = frozenset({"lock", "hide", "rename"})  # these leave every border where it is


def new_of(edited: Edited) -> list[int]:
    """Regions that an edit made or changed."""
    return np.flatnonzero(edited.kept < 0).tolist()


def names_of(tool: Tool, regions: Sequence[int]) -> str:
    """'B', 'B and C', 'B, C and D'; many are counted."""
    names = [tool.regions[a].name for a in regions]
    if len(names) > 6:
        return f"{len(names)} regions"
    return names[0] if len(names) == 1 else f"{', '.join(names[:-1])} and {names[-1]}"


def metres(points_mm: Sequence[Sequence[float]]) -> Array:
    """Points (K, 3) in metres."""
    return np.array(points_mm, float).reshape(-1, 3) * 1e-3


def _one_region(edit: Json) -> int:
    if edit.get("region") is None:
        raise InvalidInput("Say which region (region).")
    return edit["region"]
