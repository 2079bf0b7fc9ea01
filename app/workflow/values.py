"""Core values behind the rows, kept in memory: tools by segmentation, their sequencing problems, coverage reports."""

import threading
from collections import OrderedDict
from collections.abc import Callable, Hashable
from dataclasses import replace
from typing import Any

from sqlmodel import Session, col, select

from app.geometry.cad_faces import Colour
from app.geometry.carry_over import RegionMap, map_regions
from app.geometry.importing import ImportedPart
from app.geometry.merge_tree import Integers, MergeTree
from app.geometry.painted import region_colours
from app.geometry.pieces import tree_for
from app.geometry.segmentation import Patches, SegmentationParameters, find_patches, part_tree
from app.geometry.tool import Tool
from app.sequencing.features import FEATURE_SETS, FeatureSet, Interaction
from app.sequencing.problem import SequencingProblem
from app.storage import Store
from app.storage.conversions import part_from_bytes, tool_from_bytes
from app.storage.tables import RegionName, Segmentation

KEPT_TOOLS, KEPT_PROBLEMS, KEPT_REPORTS = 64, 24, 32
KEPT_TREES, KEPT_MAPS = 8, 256
KEPT_COMPARISONS = 8


class Kept:
    """A few values by key; the one used longest ago goes first. Made once even when two threads ask."""

    def __init__(self, most: int) -> None:
        self._most = most
        self._values: OrderedDict[Hashable, Any] = OrderedDict()
        self._lock = threading.RLock()

    def get(self, key: Hashable, make: Callable[[], Any]) -> Any:
        with self._lock:
            if key not in self._values:
                self._values[key] = make()
                while len(self._values) > self._most:
                    self._values.popitem(last=False)
            self._values.move_to_end(key)
            return self._values[key]

    def put(self, key: Hashable, value: Any) -> None:
        """Keep a value that came about elsewhere."""
        with self._lock:
            self.get(key, lambda: value)

    def known(self, key: Hashable) -> Any | None:
        """The value if it is kept."""
        with self._lock:
            return self._values.get(key)


class Values:
    """Reads core values; what it keeps never changes, because segmentations don't."""

    def __init__(self, store: Store) -> None:
        self._store = store
        self._tools = Kept(KEPT_TOOLS)
        self._problems = Kept(KEPT_PROBLEMS)
        self.reports = Kept(KEPT_REPORTS)
        self.measures = Kept(KEPT_MAPS)  # of regions
        self.beside = Kept(KEPT_TREES)  # patches beside locked regions
        self.comparisons = Kept(KEPT_COMPARISONS)  # of experts
        self._trees = Kept(KEPT_TREES)
        self._parts = Kept(KEPT_TREES)
        self._patches = Kept(KEPT_TREES)
        self._maps = Kept(KEPT_MAPS)
        self._colours = Kept(KEPT_MAPS)

    def tool(self, session: Session, segmentation: Segmentation) -> Tool:
        """The tool with the names people gave its regions."""
        tool: Tool = self._tools.get(segmentation.tool_sha, lambda: tool_from_bytes(self._store.artifacts.get(segmentation.tool_sha)))
        named = self._named_by(session, segmentation)
        given = {row.region: row.name for row in session.exec(select(RegionName).where(RegionName.segmentation_id == named))}
        if not given:
            return tool
        return replace(tool, regions=tuple(replace(r, name=given.get(i, r.name)) for i, r in enumerate(tool.regions)))

    def _named_by(self, session: Session, segmentation: Segmentation) -> str:
        """The segmentation whose names count: the current one while it has the same regions."""
        wanted = select(Segmentation.id).where(
            Segmentation.tool_id == segmentation.tool_id, Segmentation.tool_sha == segmentation.tool_sha, col(Segmentation.current)
        )
        return session.exec(wanted).first() or segmentation.id

    def tree(self, tool: Tool, tool_sha: str, part_sha: str | None, tree_sha: str | None) -> MergeTree:
        """The merge tree on the triangles of a cut: the kept one of its part, or one made now."""
        return self._trees.get((tool_sha, part_sha), lambda: tree_for(tool, self.part(part_sha), self.part_tree(tree_sha)))

    def remember(self, tool: Tool, tool_sha: str, part_sha: str | None, tree: MergeTree | None) -> None:
        """Keep a cut that was just made, and the merge tree on its triangles where it came with it."""
        self._tools.put(tool_sha, tool)
        if tree is not None:
            self._trees.put((tool_sha, part_sha), tree)

    def tree_after(self, tool_sha: str, part_sha: str | None, source: Integers) -> MergeTree | None:
        """The merge tree of a cut whose triangles are pieces of those of another one, if that one's tree is kept."""
        tree: MergeTree | None = self._trees.known((tool_sha, part_sha))
        return None if tree is None else tree.on(source)

    def patches(self, part_sha: str, part: ImportedPart, tree: MergeTree, parameters: SegmentationParameters) -> Patches:
        """What a part is made of before it is merged to the number of regions wanted."""
        key = (part_sha, parameters.tolerance, parameters.denoise)
        return self._patches.get(key, lambda: find_patches(part, parameters, tree))

    def part_tree(self, tree_sha: str | None) -> MergeTree | None:
        """The kept merge tree of a part; None for parts read in before it was kept, and tools without a part."""
        if tree_sha is None:
            return None
        return self._trees.get(tree_sha, lambda: MergeTree.from_bytes(self._store.artifacts.get(tree_sha)))

    def denoised_tree(self, part_sha: str) -> MergeTree:
        """The merge tree of a scan after smoothing; made once, not kept on disk."""

        def make() -> MergeTree:
            part = self.part(part_sha)
            assert part is not None
            return part_tree(part, denoise=True)

        return self._trees.get((part_sha, "denoised"), make)

    def part(self, part_sha: str | None) -> ImportedPart | None:
        """A cleaned part."""
        return None if part_sha is None else self._parts.get(part_sha, lambda: part_from_bytes(self._store.artifacts.get(part_sha)))

    def colours(self, tool: Tool, tool_sha: str, part_sha: str | None) -> tuple[Colour | None, ...]:
        """The colours the CAD file gives the regions; None each for tools without such a file."""
        part = self.part(part_sha)
        return (None,) * tool.n if part is None else self._colours.get((tool_sha, part_sha), lambda: region_colours(tool, part))

    def region_map(self, session: Session, old: Segmentation, new: Segmentation) -> RegionMap:
        """How the regions of an older cut lie in a newer one."""
        tools = self.tool(session, old), self.tool(session, new)
        return self._maps.get((old.tool_sha, new.tool_sha), lambda: map_regions(*tools))

    def problem(
        self, session: Session, segmentation: Segmentation, interactions: tuple[Interaction, ...], features: FeatureSet | None = None
    ) -> SequencingProblem:
        """The tool's sequencing problem with its tables, once built; under all features of the tool's own set if none are given."""
        graph = self.tool(session, segmentation).graph
        counted = features or FEATURE_SETS[segmentation.feature_set]
        key = (segmentation.id, counted.name, interactions)
        return self._problems.get(key, lambda: SequencingProblem(graph, counted, interactions))


def interactions_from(rows: list[dict[str, str]]) -> tuple[Interaction, ...]:
    """Interactions as stored."""
    return tuple(Interaction(row["first"], row["second"]) for row in rows)
