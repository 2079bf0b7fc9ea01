"""The job that turns a file into a tool: read, clean, cut into regions, measure."""

from dataclasses import dataclass
from functools import partial
from pathlib import Path

from sqlmodel import Session

from app.geometry.importing import ParsedFile, make_part, read_file
from app.geometry.merge_tree import MergeTree
from app.geometry.recutting import recut
from app.geometry.segmentation import SegmentationParameters, part_tree
from app.jobs.dispatcher import Handler
from app.jobs.worker import Report
from app.sequencing.features import feature_set_for
from app.storage import Store, emit
from app.storage.artifacts import keep
from app.storage.conversions import MEDIA_TYPE, part_from_bytes, part_to_bytes, tool_from_bytes, tool_to_bytes
from app.storage.tables import JobRow, ToolRow
from app.workflow.lookup import current_segmentation
from app.workflow.tool_rows import add_cut, touch_tool
from app.workflow.values import Values

KIND = "import"
LOADED = 0.3  # share of the time that reading and cleaning take


@dataclass(frozen=True)
class Order:
    """What to read and how to cut it."""

    path: str
    parsed: str | None  # path of its triangles; None for tools from before they were kept
    file_name: str
    units: str
    up: str
    body: str | None
    part: bytes | None  # read and cleaned before
    tree: bytes | None  # its merge tree, kept from before
    tool: bytes | None  # the tool as it is, to be cut anew
    locked: tuple[int, ...]  # its regions that stay
    parameters: SegmentationParameters


@dataclass(frozen=True)
class Result:
    """A tool ready to be stored."""

    part: bytes
    tree: bytes
    tool: bytes
    locked: tuple[int, ...]  # what the locked regions are now
    region_count: int
    feature_set: str
    report: tuple[tuple[str, str], ...]


def handler(store: Store, values: Values) -> Handler:
    """How import jobs are done."""
    return Handler(partial(prepare, store, values), compute, partial(finish, store), fail)


def prepare(store: Store, values: Values, session: Session, job: JobRow) -> Order | None:
    """What the row asks for; None when the tool was deleted."""
    row = session.get(ToolRow, job.subject_id)
    if row is None or row.deleted_at is not None or row.units is None or row.up is None or row.source_sha is None:
        return None
    part = store.artifacts.get(row.part_sha) if row.part_sha else None
    tree = store.artifacts.get(row.tree_sha) if row.part_sha and row.tree_sha else None
    before = current_segmentation(session, row.id) if part else None
    path = str(store.artifacts.path(row.source_sha))
    parsed = str(store.artifacts.path(row.parsed_sha)) if row.parsed_sha else None
    return Order(
        path=path,
        parsed=parsed,
        file_name=row.file_name or row.name,
        units=row.units,
        up=row.up,
        body=row.body,
        part=part,
        tree=tree,
        tool=tool_to_bytes(values.tool(session, before)) if before else None,
        locked=tuple(before.locked) if before else (),
        parameters=SegmentationParameters(**job.args),
    )


def compute(order: Order, report: Report) -> Result:
    """Read, cut and measure; pure."""
    if order.part is None:
        report(0.0, "Reading the file")
        known = ParsedFile.from_bytes(Path(order.parsed).read_bytes()) if order.parsed else read_file(Path(order.path), order.file_name)
        report(LOADED / 2, "Cleaning the surface")
        part = make_part(known, order.units, order.up, order.body)
        start = LOADED
    else:
        part, start = part_from_bytes(order.part), 0.0
    words = "Fitting planes, cylinders and spheres"
    report(start, words)
    kept = MergeTree.from_bytes(order.tree) if order.tree else part_tree(part, lambda f: report(start + (0.6 - start) * f, words))
    tree = part_tree(part, denoise=True) if order.parameters.denoise else kept
    before = tool_from_bytes(order.tool) if order.tool else None
    made = recut(part, order.parameters, tree, before, order.locked, lambda f, message: report(0.6 + 0.35 * f, message))
    tool, features = made.tool, feature_set_for(made.tool.graph).name
    return Result(part_to_bytes(part), kept.to_bytes(), tool_to_bytes(tool), made.held, tool.n, features, part.report.lines)


def finish(store: Store, session: Session, job: JobRow, result: Result) -> None:
    """Store the cut and show the tool."""
    row = session.get(ToolRow, job.subject_id)
    if row is None or row.deleted_at is not None:
        return
    same_part = row.part_sha is not None
    row.part_sha = keep(session, store.artifacts.put(result.part), len(result.part), MEDIA_TYPE)
    row.report = [{"level": level, "text": text} for level, text in result.report]
    row.state, row.questions, row.error = "ready", None, None
    row.tree_sha = keep(session, store.artifacts.put(result.tree), len(result.tree), MEDIA_TYPE)
    before = current_segmentation(session, row.id)
    cut = add_cut(session, store, row, result.tool, result.region_count, result.feature_set, job.args)
    if before is not None and same_part:
        cut.parent_id, cut.words, before.redo_id = before.id, f"Cut into {result.region_count} regions", cut.id
        cut.locked = list(result.locked)
        session.add_all([cut, before])
    touch_tool(session, row)
    emit(session, "coverage.changed", row.project_id)


def fail(session: Session, job: JobRow, error: dict[str, str]) -> None:
    """Show what was wrong; a tool that was cut before stays usable."""
    row = session.get(ToolRow, job.subject_id)
    if row is not None:
        row.state = "ready" if current_segmentation(session, row.id) else "failed"
        row.error = error
        touch_tool(session, row)
