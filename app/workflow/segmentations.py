"""Editing a tool's regions: each edit is a new segmentation, undo and redo move the pointer to the current one."""

import csv
import io
from functools import partial
from typing import Any

import numpy as np
from sqlmodel import Session, col, func, select

from app.errors import Conflict, InvalidInput, StaleVersion
from app.geometry.importing import ImportedPart
from app.geometry.merge_tree import MergeTree
from app.geometry.recutting import beside_locked, recut
from app.geometry.segmentation import Patches, SegmentationParameters
from app.geometry.tool import Tool
from app.jobs.rows import unfinished_job
from app.sequencing.features import feature_set_for
from app.storage import emit
from app.storage.conversions import tool_to_bytes
from app.storage.tables import Demonstration, Draft, Plan, RegionName, Run, Segmentation, ToolRow
from app.workflow.context import Context
from app.workflow.editing_views import follow_edit, follow_jump
from app.workflow.edits import SAME_REGIONS, After, Before, apply
from app.workflow.lookup import found, present, ready_segmentation, refuse_training_on
from app.workflow.region_rows import MEASURED, measured, neighbour_angles
from app.workflow.tool_rows import add_cut, tool_json, touch_tool
from app.workflow.tools import region_json

Json = dict[str, Any]

CSV_COLUMNS = (
    "id", "name", "description", "kind", "area_mm2", "curvature_per_m", "height", "centroid_x_mm", "centroid_y_mm", "centroid_z_mm",
    "normal_x", "normal_y", "normal_z", "perimeter_mm", "free_border_mm", "length_mm", "width_mm", "aspect", "direction_deg",
    "neighbours", "neighbour_angles_deg", "corner_neighbours", "locked", "hidden",
)  # fmt: skip


def edit_tool(ctx: Context, tool_id: str, edit: Json, segmentation_id: str | None = None) -> Json:
    """Edit the regions; computed beside the database, stored when nothing else has changed them meanwhile.

    Raises:
        InvalidInput: What can't be done, in a sentence.
        Conflict: The tool is being read in or trained on, or its regions were changed meanwhile.
    """
    before_id, before = ctx.store.read(lambda session: _before(ctx, session, tool_id, edit["kind"], segmentation_id))
    after = apply(before, edit)
    shaped = edit["kind"] not in SAME_REGIONS
    content = tool_to_bytes(after.tool) if shaped else b""

    def change(session: Session) -> Json:
        row, parent = _editable(session, tool_id, edit["kind"])
        _check_unchanged(row, parent, before_id)
        if shaped:
            features = feature_set_for(after.tool.graph).name
            cut = add_cut(session, ctx.store, row, content, after.tool.n, features, {"edit": edit})
            tree = None if after.source is None else ctx.values.tree_after(parent.tool_sha, row.part_sha, after.source)
            ctx.values.remember(after.tool, cut.tool_sha, row.part_sha, tree)
        else:
            cut = _same_regions(session, parent, after)
        _join_history(session, parent, cut, edit["kind"], after)
        follow_edit(ctx.values, session, row, after)
        return _tell(session, row, shaped)

    return ctx.store.write(change)


def rename_region(ctx: Context, tool_id: str, region: int, name: str) -> Json:
    """Give a region another name.

    Raises:
        InvalidInput: No such region, an empty name, or one that another region has.
    """
    edit_tool(ctx, tool_id, {"kind": "rename", "region": region, "name": name})
    return list_regions(ctx, tool_id)[region]


def recut_tool(ctx: Context, tool_id: str, parameters: Json, segmentation_id: str | None = None, *, continues: bool = False) -> Json:
    """Cut the tool anew at once, from the kept merge tree; locked regions stay.

    With `continues` the cut takes the place of the one before in the history, if that was made by a slider too and nothing was
    done with it.

    Raises:
        Conflict: No merge tree is kept; cut it as background work instead.
    """
    known = SegmentationParameters(**parameters)

    def value(session: Session) -> tuple[str, Before, Before, ImportedPart, MergeTree, Patches]:
        before_id, before = _before(ctx, session, tool_id, "cut", segmentation_id)
        row = present(session, ToolRow, tool_id)
        part, tree = ctx.values.part(row.part_sha), ctx.values.part_tree(row.tree_sha)
        if part is None or row.part_sha is None:
            raise InvalidInput(f"{row.name} comes with its regions; only tools made from a CAD file can be cut anew.")
        if tree is None:
            raise Conflict(f"{row.name} was read in before its merges were kept. Cut it once in the background, then this works at once.")
        if known.denoise:
            tree = ctx.values.denoised_tree(row.part_sha)
        base = _replaced_base(ctx, session, row) if continues else None
        patches = ctx.values.patches(row.part_sha, part, tree, known)
        return before_id, before, base or before, part, tree, patches

    before_id, before, base, part, tree, patches = ctx.store.read(value)
    here = base.tree() if base.locked else None
    if here is not None:
        key = ("beside", base.tool_sha, base.locked, known.tolerance, known.denoise)
        patches = ctx.values.beside.get(key, lambda: beside_locked(base.tool, base.locked, patches, tree, here))
    made = recut(part, known, tree, base.tool, base.locked, patches=patches, here=here)
    tool, held = made.tool, made.held
    kept = (*sorted(before.locked), *[-1] * (tool.n - len(held)))  # the locked ones come first, in their order
    hidden = tuple(a for a, old in enumerate(kept) if old in before.hidden)
    after = After(tool, kept, tuple(held), hidden, f"Cut into {tool.n} regions")
    content = tool_to_bytes(tool)

    def change(session: Session) -> Json:
        row, parent = _editable(session, tool_id, "cut")
        _check_unchanged(row, parent, before_id)
        cut = add_cut(session, ctx.store, row, content, tool.n, feature_set_for(tool.graph).name, vars(known))
        ctx.values.remember(tool, cut.tool_sha, row.part_sha, None if known.denoise else made.tree)
        replaced = parent if continues and parent.parent_id and _only_passed(session, parent) else None
        if replaced is not None:
            parent = found(session, Segmentation, replaced.parent_id or "", "segmentation")
        _join_history(session, parent, cut, "cut", after)
        if replaced is not None:
            session.delete(replaced)
        follow_edit(ctx.values, session, row, after)
        return _tell(session, row, shaped=True)

    return ctx.store.write(change)


def undo(ctx: Context, tool_id: str) -> Json:
    """Go back one edit.

    Raises:
        Conflict: There is none to undo.
    """

    def target(session: Session, row: ToolRow, cut: Segmentation) -> Segmentation:
        if cut.parent_id is None:
            raise Conflict(f"Nothing to undo: {row.name} is as it was read in.")
        return found(session, Segmentation, cut.parent_id, "segmentation")

    return _jump(ctx, tool_id, target, remember=True)


def redo(ctx: Context, tool_id: str) -> Json:
    """Go forward to the edit last undone.

    Raises:
        Conflict: There is none.
    """

    def target(session: Session, row: ToolRow, cut: Segmentation) -> Segmentation:
        if cut.redo_id is None:
            raise Conflict(f"Nothing to redo: the last edit of {row.name} is shown.")
        return found(session, Segmentation, cut.redo_id, "segmentation")

    return _jump(ctx, tool_id, target, remember=False)


def restore(ctx: Context, tool_id: str, segmentation_id: str) -> Json:
    """Go to any step of the history."""

    def target(session: Session, row: ToolRow, _cut: Segmentation) -> Segmentation:
        row_wanted = found(session, Segmentation, segmentation_id, "segmentation")
        if row_wanted.tool_id != row.id or row_wanted.id not in {s.id for s in _steps(session, row)}:
            raise Conflict(f"This segmentation doesn't belong to what {row.name} is now, so it can't be gone back to.")
        return row_wanted

    return _jump(ctx, tool_id, target, remember=False)


def history(ctx: Context, tool_id: str) -> Json:
    """All steps, oldest first."""

    def query(session: Session) -> Json:
        row = present(session, ToolRow, tool_id)
        cut = ready_segmentation(session, row)
        steps = _steps(session, row)
        done, ahead = _line(session, cut)
        counted = select(Demonstration.segmentation_id, func.count()).where(col(Demonstration.deleted_at).is_(None))
        shown = dict(session.exec(counted.where(Demonstration.tool_id == row.id).group_by(Demonstration.segmentation_id)).all())
        items = [
            {
                "id": step.id,
                "words": step.words,
                "kind": step.kind,
                "created_at": step.created_at,
                "region_count": step.region_count,
                "current": step.id == cut.id,
                "undone": step.id in ahead,
                "abandoned": step.id not in done and step.id not in ahead,
                "parent_id": step.parent_id,
                "same_regions_as": next((s.id for s in steps if s.tool_sha == step.tool_sha and s.id < step.id), None),
                "demonstrations": shown.get(step.id, 0),
            }
            for step in steps
        ]
        return {"items": items, "next": None, "can_undo": cut.parent_id is not None, "can_redo": cut.redo_id is not None}

    return ctx.store.read(query)


def list_regions(ctx: Context, tool_id: str) -> list[Json]:
    """The regions with their attributes and marks; the position is the region id."""

    def query(session: Session) -> tuple[Tool, Segmentation, str | None]:
        row = present(session, ToolRow, tool_id)
        cut = ready_segmentation(session, row)
        return ctx.values.tool(session, cut), cut, row.part_sha

    tool, cut, part_sha = ctx.store.read(query)
    colours = ctx.values.colours(tool, cut.tool_sha, part_sha)
    shapes = measured(ctx.values, tool, cut.tool_sha)
    return [
        {
            **region_json(tool, a),
            **shapes[a],
            "corner_neighbours": [int(b) for b in np.flatnonzero(tool.graph.corner[a])],
            "locked": a in cut.locked,
            "hidden": a in cut.hidden,
            "colour": None if (painted := colours[a]) is None else "#{:02x}{:02x}{:02x}".format(*painted),
        }
        for a in range(tool.n)
    ]


def regions_csv(ctx: Context, tool_id: str) -> str:
    """The regions as a table with units in its header."""
    rows = list_regions(ctx, tool_id)
    angles = neighbour_angles(ctx, tool_id)
    names = [row["name"] for row in rows]
    file = io.StringIO()
    writer = csv.writer(file, lineterminator="\r\n")
    writer.writerow(CSV_COLUMNS)
    for row in rows:
        shape = [f"{v:.6g}" for v in (row["area_mm2"], row["curvature_per_m"], row["height"], *row["centroid_mm"], *row["normal"])]
        border = ["" if (v := row[key]) is None else f"{v:.6g}" for key in MEASURED]
        words = [_harmless(row[key]) for key in ("name", "description", "kind")]
        beside, corners = (" ".join(_harmless(names[b]) for b in row[key]) for key in ("neighbours", "corner_neighbours"))
        turns = " ".join("-" if (angle := angles.get((row["id"], b))) is None else f"{angle:.4g}" for b in row["neighbours"])
        writer.writerow(
            [row["id"], *words, *shape, *border, beside, turns, corners, str(row["locked"]).lower(), str(row["hidden"]).lower()]
        )
    return file.getvalue()


def _harmless(text: str) -> str:
    """A spreadsheet must not take a name for a formula."""
    return f"'{text}" if text[:1] in ("=", "+", "-", "@") else text


def _before(ctx: Context, session: Session, tool_id: str, kind: str, segmentation_id: str | None) -> tuple[str, Before]:
    row, cut = _editable(session, tool_id, kind)
    if segmentation_id is not None:
        _check_unchanged(row, cut, segmentation_id)
    return cut.id, _as_before(ctx, session, row, cut)


def _replaced_base(ctx: Context, session: Session, row: ToolRow) -> Before | None:
    """What the slider started from, when all it did since takes the place of what it did before: cuts don't pile up on each other."""
    cut = ready_segmentation(session, row)
    if cut.parent_id is None or not _only_passed(session, cut):
        return None
    start = found(session, Segmentation, cut.parent_id, "segmentation")
    return _as_before(ctx, session, row, start)


def _as_before(ctx: Context, session: Session, row: ToolRow, cut: Segmentation) -> Before:
    tool = ctx.values.tool(session, cut)
    tree = partial(ctx.values.tree, tool, cut.tool_sha, row.part_sha, row.tree_sha)
    return Before(tool, tuple(cut.locked), tuple(cut.hidden), cut.tool_sha, tree)


def _editable(session: Session, tool_id: str, kind: str) -> tuple[ToolRow, Segmentation]:
    """The tool and its current cut, when it may be edited now."""
    row = present(session, ToolRow, tool_id)
    cut = ready_segmentation(session, row)
    if row.kind == "table" and kind not in SAME_REGIONS:
        raise InvalidInput(f"{row.name} comes from a region table, which says what its regions are. Change the table and import it again.")
    if unfinished_job(session, row.id):
        raise Conflict(f"{row.name} is being cut. Wait until that is done.")
    if kind not in SAME_REGIONS:
        refuse_training_on(session, row)
    return row, cut


def _check_unchanged(row: ToolRow, cut: Segmentation, expected: str) -> None:
    if cut.id != expected:
        raise StaleVersion(f"The regions of {row.name} were changed meanwhile. Look at them again, then repeat the edit.")


def _only_passed(session: Session, cut: Segmentation) -> bool:
    """Whether a cut was made by a slider, and nothing refers to it."""
    if cut.kind != "cut" or cut.params.get("target") is None:
        return False
    runs = session.exec(select(Run.interest).join(ToolRow, col(ToolRow.project_id) == Run.project_id).where(ToolRow.id == cut.tool_id))
    references = (
        select(col(Segmentation.id)).where(Segmentation.parent_id == cut.id),
        *(select(col(table.segmentation_id)).where(table.segmentation_id == cut.id) for table in (Demonstration, Draft, Plan, RegionName)),
    )
    return not any(session.exec(query).first() for query in references) and not any(cut.id in interest for interest in runs)


def _same_regions(session: Session, parent: Segmentation, after: After) -> Segmentation:
    """A new current segmentation with the regions of the one before; only marks and names differ."""
    parent.current = False
    session.add(parent)
    session.flush()
    cut = Segmentation(
        tool_id=parent.tool_id,
        params=parent.params,
        tool_sha=parent.tool_sha,
        region_count=parent.region_count,
        feature_set=parent.feature_set,
    )
    session.add(cut)
    session.flush()
    for region, its in enumerate(after.tool.regions):
        session.add(RegionName(segmentation_id=cut.id, region=region, name=its.name))
    return cut


def _join_history(session: Session, parent: Segmentation, cut: Segmentation, kind: str, after: After) -> None:
    cut.parent_id, cut.kind, cut.words = parent.id, kind, after.words
    cut.locked, cut.hidden = list(after.locked), list(after.hidden)
    parent.redo_id = cut.id
    session.add(cut)
    session.add(parent)
    session.flush()


def _tell(session: Session, row: ToolRow, shaped: bool) -> Json:
    touch_tool(session, row)
    emit(session, "draft.changed", row.project_id, tool_id=row.id)
    if shaped:
        emit(session, "coverage.changed", row.project_id)
    return tool_json(session, row)


def _jump(ctx: Context, tool_id: str, target: Any, *, remember: bool) -> Json:
    """Make another step of the history the current one."""

    def change(session: Session) -> Json:
        row = present(session, ToolRow, tool_id)
        cut = ready_segmentation(session, row)
        wanted: Segmentation = target(session, row, cut)
        shaped = wanted.tool_sha != cut.tool_sha
        _editable(session, tool_id, "cut" if shaped else "lock")
        cut.current = False
        session.add(cut)
        session.flush()
        if remember:
            wanted.redo_id = cut.id
        wanted.current = True
        session.add(wanted)
        session.flush()
        follow_jump(ctx.values, session, row, shaped)
        return _tell(session, row, shaped)

    return ctx.store.write(change)


def _steps(session: Session, row: ToolRow) -> list[Segmentation]:
    """Every step that hangs together with the current one, oldest first."""
    rows = list(session.exec(select(Segmentation).where(Segmentation.tool_id == row.id).order_by(col(Segmentation.id))))
    parent = {s.id: s.parent_id for s in rows}

    def root(key: str) -> str:
        while (above := parent[key]) is not None:
            key = above
        return key

    here = next(s.id for s in rows if s.current)
    return [s for s in rows if root(s.id) == root(here)]


def _line(session: Session, cut: Segmentation) -> tuple[set[str], set[str]]:
    """Ids of the steps that lead to the current one, and of those a redo would go through."""
    done, ahead = {cut.id}, set[str]()
    at = cut
    while at.parent_id is not None:
        at = found(session, Segmentation, at.parent_id, "segmentation")
        done.add(at.id)
    at = cut
    while at.redo_id is not None and at.redo_id not in ahead | done:
        at = found(session, Segmentation, at.redo_id, "segmentation")
        ahead.add(at.id)
    return done, ahead
