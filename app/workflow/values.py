"""Core values behind the rows, kept in memory: tools by segmentation, their sequencing problems, coverage reports."""

import threading
from collections import OrderedDict
from collections.abc import Callable, Hashable
from dataclasses import replace
from typing import Any

from sqlmodel import Session, select

from app.geometry.tool import Tool
from app.sequencing.features import FEATURE_SETS, Interaction
from app.sequencing.problem import SequencingProblem
from app.storage import Store
from app.storage.conversions import tool_from_bytes
from app.storage.tables import RegionName, Segmentation

KEPT_TOOLS, KEPT_PROBLEMS, KEPT_REPORTS = 64, 24, 32


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


class Values:
    """Reads core values; what it keeps never changes, because segmentations don't."""

    def __init__(self, store: Store) -> None:
        self._store = store
        self._tools = Kept(KEPT_TOOLS)
        self._problems = Kept(KEPT_PROBLEMS)
        self.reports = Kept(KEPT_REPORTS)

    def tool(self, session: Session, segmentation: Segmentation) -> Tool:
        """The tool with the names people gave its regions."""
        tool: Tool = self._tools.get(segmentation.id, lambda: tool_from_bytes(self._store.artifacts.get(segmentation.tool_sha)))
        given = {row.region: row.name for row in session.exec(select(RegionName).where(RegionName.segmentation_id == segmentation.id))}
        if not given:
            return tool
        return replace(tool, regions=tuple(replace(r, name=given.get(i, r.name)) for i, r in enumerate(tool.regions)))

    def problem(self, session: Session, segmentation: Segmentation, interactions: tuple[Interaction, ...]) -> SequencingProblem:
        """The tool's sequencing problem with its tables, once built."""
        graph = self.tool(session, segmentation).graph
        features = FEATURE_SETS[segmentation.feature_set]
        return self._problems.get((segmentation.id, interactions), lambda: SequencingProblem(graph, features, interactions))


def interactions_from(rows: list[dict[str, str]]) -> tuple[Interaction, ...]:
    """Interactions as stored."""
    return tuple(Interaction(row["first"], row["second"]) for row in rows)
