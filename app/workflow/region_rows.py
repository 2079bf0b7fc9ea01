"""What is measured of regions and of how they lie to each other, as REST and the table beside the view show it."""

from typing import Any

import numpy as np
from sqlmodel import Session

from app.geometry.borders import FREE, find_borders
from app.geometry.distances import surface_distances
from app.geometry.neighbours import Neighbours, find_neighbours
from app.geometry.sizes import region_sizes
from app.geometry.tool import Tool
from app.storage.tables import ToolRow
from app.workflow.context import Context
from app.workflow.lookup import present, ready_segmentation
from app.workflow.values import Values

Json = dict[str, Any]

MEASURED = ("perimeter_mm", "free_border_mm", "length_mm", "width_mm", "aspect", "direction_deg")
NOT_MEASURED: Json = dict.fromkeys(MEASURED)


def measured(values: Values, tool: Tool, tool_sha: str) -> list[Json]:
    """Size and border of each region, kept by its mesh; nothing for tools from a table, whose picture is only drawn."""
    return values.measures.get(("regions", tool_sha), lambda: _measure(tool))


def list_neighbours(ctx: Context, tool_id: str) -> Json:
    """Which regions touch, how and at which angle, and how far all of them lie apart along the surface."""
    tool, tool_sha = ctx.store.read(lambda session: _current(ctx, session, tool_id))
    ways = ctx.values.measures.get(("ways", tool_sha), lambda: _ways(tool))
    items = [
        {
            "a": pair.a,
            "b": pair.b,
            "touch": pair.touch,
            "across": pair.across,
            "border_mm": pair.border * 1e3 if on_mesh(tool) else None,
            "angle_deg": None if pair.angle is None else float(np.degrees(pair.angle)),
            "distance_mm": None if ways is None else ways[pair.a][pair.b],
        }
        for pair in touching(ctx.values, tool, tool_sha)
    ]
    return {"items": items, "next": None, "distances_mm": ways}


def touching(values: Values, tool: Tool, tool_sha: str) -> tuple[Neighbours, ...]:
    """Pairs of regions that touch."""
    return values.measures.get(("neighbours", tool_sha), lambda: find_neighbours(tool) if on_mesh(tool) else _listed(tool))


def neighbour_angles(ctx: Context, tool_id: str) -> dict[tuple[int, int], float]:
    """Angle in degrees by region and neighbour, where it is measured."""
    tool, tool_sha = ctx.store.read(lambda session: _current(ctx, session, tool_id))
    known = [(pair, float(np.degrees(pair.angle))) for pair in touching(ctx.values, tool, tool_sha) if pair.angle is not None]
    return {key: angle for pair, angle in known for key in ((pair.a, pair.b), (pair.b, pair.a))}


def on_mesh(tool: Tool) -> bool:
    """Whether the tool's surface is that of a part; regions of a table are drawn from what it lists."""
    return tool.graph.source == "mesh" and all(region.kind != "listed" for region in tool.regions)


def _current(ctx: Context, session: Session, tool_id: str) -> tuple[Tool, str]:
    cut = ready_segmentation(session, present(session, ToolRow, tool_id))
    return ctx.values.tool(session, cut), cut.tool_sha


def _measure(tool: Tool) -> list[Json]:
    if not on_mesh(tool):
        return [NOT_MEASURED] * tool.n
    borders = find_borders(tool.mesh, tool.labels)
    free = borders.beyond == FREE
    perimeter, free_border = borders.perimeter(tool.n), np.bincount(borders.region[free], weights=borders.length[free], minlength=tool.n)
    return [
        {
            "length_mm": size.length * 1e3,
            "width_mm": size.width * 1e3,
            "aspect": size.aspect,
            "direction_deg": None if size.direction is None else float(np.degrees(size.direction)),
            "perimeter_mm": float(perimeter[a]) * 1e3,
            "free_border_mm": float(free_border[a]) * 1e3,
        }
        for a, size in enumerate(region_sizes(tool))
    ]


def _ways(tool: Tool) -> list[list[float | None]] | None:
    """Distances between all regions, mm; None for pieces that don't hang together."""
    if not on_mesh(tool):
        return None
    far = surface_distances(tool.mesh, tool.labels, np.array([region.centroid for region in tool.regions])) * 1e3
    return [[float(way) if np.isfinite(way) else None for way in row] for row in far]


def _listed(tool: Tool) -> tuple[Neighbours, ...]:
    """Neighbours as a table lists them, on either side."""
    beside, corner = (matrix | matrix.T for matrix in (tool.graph.neighbour, tool.graph.corner))
    pairs = [(int(a), int(b)) for a, b in np.argwhere(np.triu(beside | corner, 1))]
    return tuple(Neighbours(a, b, "border" if beside[a, b] else "corner", 0.0, None, None) for a, b in pairs)
