"""The job that turns a file into a tool: read, clean, cut into regions, measure."""

from dataclasses import dataclass
from functools import partial
from pathlib import Path

from sqlmodel import Session

from app.geometry.importing import ParsedFile, make_part, read_file
from app.geometry.regions import measure
from app.geometry.segmentation import SegmentationParameters, segment
from app.jobs.dispatcher import Handler
from app.jobs.worker import Report
from app.sequencing.features import feature_set_for
from app.storage import Store, emit
from app.storage.artifacts import keep
from app.storage.conversions import MEDIA_TYPE, part_from_bytes, part_to_bytes, tool_to_bytes
from app.storage.tables import JobRow, ToolRow
from app.workflow.lookup import current_segmentation
from app.workflow.tool_rows import add_cut, touch_tool

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
    parameters: SegmentationParameters


@dataclass(frozen=True)
class Result:
    """A tool ready to be stored."""

    part: bytes
    tool: bytes
    region_count: int
    feature_set: str
    report: tuple[tuple[str, str], ...]


def handler(store: Store) -> Handler:
    """How import jobs are done."""
    return Handler(partial(prepare, store), compute, partial(finish, store), fail)


def prepare(store: Store, session: Session, job: JobRow) -> Order | None:
    """What the row asks for; None when the tool was deleted."""
    row = session.get(ToolRow, job.subject_id)
    if row is None or row.deleted_at is not None or row.units is None or row.up is None or row.source_sha is None:
        return None
    part = store.artifacts.get(row.part_sha) if row.part_sha else None
    path = str(store.artifacts.path(row.source_sha))
    parsed = str(store.artifacts.path(row.parsed_sha)) if row.parsed_sha else None
    return Order(path, parsed, row.file_name or row.name, row.units, row.up, row.body, part, SegmentationParameters(**job.args))


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
    cut = segment(part, order.parameters, lambda fraction, message: report(start + (0.95 - start) * fraction, message))
    report(0.95, "Measuring the regions")
    tool = measure(cut.part.mesh, cut.labels)
    return Result(part_to_bytes(part), tool_to_bytes(tool), tool.n, feature_set_for(tool.graph).name, part.report.lines)


def finish(store: Store, session: Session, job: JobRow, result: Result) -> None:
    """Store the cut and show the tool."""
    row = session.get(ToolRow, job.subject_id)
    if row is None or row.deleted_at is not None:
        return
    row.part_sha = keep(session, store.artifacts.put(result.part), len(result.part), MEDIA_TYPE)
    row.report = [{"level": level, "text": text} for level, text in result.report]
    row.state, row.questions, row.error = "ready", None, None
    add_cut(session, store, row, result.tool, result.region_count, result.feature_set, job.args)
    touch_tool(session, row)
    emit(session, "coverage.changed", row.project_id)


def fail(session: Session, job: JobRow, error: dict[str, str]) -> None:
    """Show what was wrong; a tool that was cut before stays usable."""
    row = session.get(ToolRow, job.subject_id)
    if row is not None:
        row.state = "ready" if current_segmentation(session, row.id) else "failed"
        row.error = error
        touch_tool(session, row)
