"""Simulate a robot working through a sequence of regions."""

from collections.abc import Sequence

from app.geometry.tool import Tool
from app.robot.parameters import RobotParameters
from app.robot.reports import Playback, RegionReport, Report, ignore, playback_from_bytes, playback_to_bytes

__all__ = ["Playback", "RegionReport", "RobotParameters", "playback_from_bytes", "playback_to_bytes", "simulate"]


def simulate(tool: Tool, sequence: Sequence[int], parameters: RobotParameters, report: Report = ignore) -> Playback:
    """The run of `sequence` on `tool`; not written yet."""
    raise NotImplementedError
