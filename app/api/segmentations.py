"""The regions of a tool: cutting it anew, editing by hand, undo and redo, names, and the table of attributes."""

from typing import Annotated, Literal

from fastapi import APIRouter, Response
from pydantic import Field, FiniteFloat

from app.api.dependencies import Body, Ctx, Json, RegionId, Row, located, tagged
from app.api.idempotency import ActionRoute, IdempotencyKey
from app.api.tools import Tool
from app.geometry.segmentation import MOST_TARGET
from app.workflow import region_rows, tools
from app.workflow import segmentations as workflow

router = APIRouter(prefix="/tools/{tool_id}", tags=["regions"], route_class=ActionRoute)

Coordinate = Annotated[FiniteFloat, Field(ge=-1e6, le=1e6)]
PointMm = Annotated[list[Coordinate], Field(min_length=3, max_length=3, description="x, y, z in the tool frame, mm.")]
PathMm = Annotated[list[PointMm], Field(min_length=1, max_length=100)]
Id = Annotated[str, Field(max_length=64)]
Count = Annotated[int, Field(ge=1, le=20)]


class Edit(Body):
    """One edit by hand; which fields count depends on its kind."""

    kind: Literal["merge", "split_plane", "split_grid", "cut", "reassign", "working", "lock", "hide", "rename"]
    region: RegionId | None = None
    regions: Annotated[list[RegionId], Field(default_factory=list, max_length=200)]
    point_mm: PointMm | None = None
    points_mm: PathMm | None = None
    path_mm: PathMm | None = None
    closed: bool = False
    normal: Annotated[list[Coordinate], Field(min_length=3, max_length=3)] | None = None
    rows: Count | None = None
    columns: Count | None = None
    size_mm: Annotated[FiniteFloat, Field(gt=0, le=1e6, description="About how wide a cell of the grid is.")] | None = None
    aspect: Annotated[FiniteFloat, Field(ge=0.05, le=20, description="Width over depth of a cell.")] | None = None
    level: Annotated[int, Field(ge=1, le=1000, description="1: the largest piece under the click, 2: the next smaller one, ...")] = 1
    to: RegionId | Literal["new"] | None = None
    on: bool | None = None
    name: Annotated[str, Field(max_length=40)] | None = None


class SegmentationOrder(Body):
    """An edit, or how finely to cut."""

    edit: Edit | None = None
    segmentation_id: Annotated[
        Id | None, Field(description="The cut the edit was made on; refused when it is no longer the current one.")
    ] = None
    now: Annotated[bool, Field(description="Answer at once from the kept merges instead of in the background.")] = False
    continues: Annotated[
        bool, Field(description="Like the cut before, made by the same drag of a slider: with it one step of the history. Needs `now`.")
    ] = False
    target: Annotated[int, Field(ge=1, le=MOST_TARGET, description="Regions wanted; left out: decided by the tolerance.")] | None = None
    tolerance: Annotated[float, Field(gt=0, lt=1, description="Fit error allowed, relative to the part's size.")] | None = None
    minimum_area: Annotated[float, Field(ge=0, le=0.5, description="Smaller shares of the working surface go to a neighbour.")] | None = (
        None
    )
    denoise: Annotated[bool, Field(description="For scans: smooth the surface first.")] | None = None
    absorb_fillets: Annotated[bool, Field(description="Give narrow roundings to the larger regions beside them.")] | None = None
    preset: Annotated[Literal["default", "paper-like"], Field(description="paper-like: 6 to 14 similar patches.")] | None = None


class RegionName(Body):
    """The name people use for a region."""

    name: Annotated[str, Field(min_length=1, max_length=40)]


class Region(Row):
    """One patch of the tool's working surface."""

    id: int
    name: str
    description: str
    area_mm2: float
    curvature_per_m: float
    kind: str
    centroid_mm: list[float]
    normal: list[float]
    height: float
    neighbours: Annotated[list[int], Field(description="Regions it shares a border with.")]
    corner_neighbours: Annotated[list[int], Field(description="Regions it touches in a point only.")]
    perimeter_mm: float | None
    free_border_mm: float | None
    length_mm: Annotated[float | None, Field(description="Longer side along the surface; cylinders and cones are unrolled.")]
    width_mm: Annotated[float | None, Field(description="Shorter side along the surface.")]
    aspect: Annotated[float | None, Field(description="Length over width.")]
    direction_deg: Annotated[
        float | None, Field(description="Where the longer side points seen from above, 0 to 180 from x; null for squares and upright ones.")
    ]
    locked: bool
    hidden: bool
    colour: Annotated[str | None, Field(description="What most of it is painted in the CAD file, #rrggbb.")]


class RegionList(Row):
    """All regions of a tool; the position is the region id."""

    items: list[Region]
    next: None = None


class Neighbours(Row):
    """Two regions that touch."""

    a: int
    b: int
    touch: Annotated[
        Literal["border", "rounding", "corner"],
        Field(description="border: a shared line; rounding: the faces on both sides of a narrow fillet; corner: a point only."),
    ]
    across: Annotated[int | None, Field(description="The rounding between them.")]
    border_mm: float | None
    angle_deg: Annotated[
        float | None, Field(description="What the surface turns by from one to the other: + a ridge, - a valley, 0 level.")
    ]
    distance_mm: Annotated[float | None, Field(description="From middle to middle along the surface.")]


class NeighbourList(Row):
    """Pairs of regions that touch, and how far all lie apart."""

    items: list[Neighbours]
    next: None = None
    distances_mm: Annotated[
        list[list[float | None]] | None,
        Field(description="From each region's middle to each other's along the working surface; null where none leads there."),
    ]


class Step(Row):
    """One step of the history of a tool's regions."""

    id: str
    words: str
    kind: str
    created_at: str
    region_count: int
    current: bool
    undone: bool
    abandoned: bool
    parent_id: str | None
    same_regions_as: str | None
    demonstrations: int


class History(Row):
    """All steps, oldest first."""

    items: list[Step]
    next: None = None
    can_undo: bool
    can_redo: bool


@router.post("/segmentations", status_code=201, response_model=Tool, responses={202: {"model": Tool, "description": "Being cut."}})
def segment_tool(ctx: Ctx, tool_id: str, body: SegmentationOrder, response: Response, _key: IdempotencyKey = None) -> Json:
    """Edit the regions (201), or cut the tool anew (202, or 201 with `now`). Demonstrations keep the regions they were clicked on."""
    if body.edit is not None:
        edit = body.edit.model_dump(exclude_unset=True)
        return located(response, "tools", workflow.edit_tool(ctx, tool_id, edit, body.segmentation_id))
    parameters = body.model_dump(exclude_none=True, exclude={"edit", "segmentation_id", "now", "continues"})
    if body.now:
        return located(response, "tools", workflow.recut_tool(ctx, tool_id, parameters, body.segmentation_id, continues=body.continues))
    response.status_code = 202
    return located(response, "tools", tools.segment_tool(ctx, tool_id, parameters))


@router.get("/segmentations", response_model=History)
def list_segmentations(ctx: Ctx, tool_id: str) -> Json:
    """The history of the tool's regions."""
    return workflow.history(ctx, tool_id)


@router.post("/segmentations/undo", response_model=Tool)
def undo_edit(ctx: Ctx, tool_id: str, response: Response, _key: IdempotencyKey = None) -> Json:
    """Take the last edit back."""
    return tagged(response, workflow.undo(ctx, tool_id))


@router.post("/segmentations/redo", response_model=Tool)
def redo_edit(ctx: Ctx, tool_id: str, response: Response, _key: IdempotencyKey = None) -> Json:
    """Do again what was undone."""
    return tagged(response, workflow.redo(ctx, tool_id))


@router.post("/segmentations/{segmentation_id}/restore", response_model=Tool)
def restore_segmentation(ctx: Ctx, tool_id: str, segmentation_id: str, response: Response, _key: IdempotencyKey = None) -> Json:
    """Go to any step of the history."""
    return tagged(response, workflow.restore(ctx, tool_id, segmentation_id))


@router.get("/regions")
def list_regions(ctx: Ctx, tool_id: str) -> RegionList:
    """The regions with what the features see of them."""
    return RegionList(items=[Region.model_validate(row) for row in workflow.list_regions(ctx, tool_id)])


@router.get("/regions.csv", response_class=Response, responses={200: {"content": {"text/csv": {}}}})
def regions_csv(ctx: Ctx, tool_id: str) -> Response:
    """The regions as a table; units are in its header."""
    headers = {"Content-Disposition": 'attachment; filename="regions.csv"'}
    return Response(workflow.regions_csv(ctx, tool_id), media_type="text/csv; charset=utf-8", headers=headers)


@router.get("/neighbours")
def list_neighbours(ctx: Ctx, tool_id: str) -> NeighbourList:
    """Which regions touch, how, at which angle, and how far regions lie apart along the surface."""
    return NeighbourList.model_validate(region_rows.list_neighbours(ctx, tool_id))


@router.patch("/regions/{region}", response_model=Region)
def rename_region(ctx: Ctx, tool_id: str, region: RegionId, body: RegionName) -> Json:
    """Give a region another name; this can be undone like an edit."""
    return workflow.rename_region(ctx, tool_id, region, body.name)
