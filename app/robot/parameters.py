"""What a person may set for the preview of the robot, and the constants of planning and control beside it."""

from dataclasses import dataclass


@dataclass(frozen=True)
class RobotParameters:
    """How the roller is led over the tool."""

    force_n: float = 20.0  # N, commanded along the surface normal
    tip_speed: float = 0.12  # m/s in contact
    transfer_speed: float = 0.4  # m/s of the tip between regions
    clearance: float = 0.08  # m above the highest point of the tool while moving between regions
    spring: float = 5000.0  # N/m of the roller's slide
    log_rate: float = 25.0  # Hz of the stored playback


@dataclass(frozen=True)
class RollerSize:
    """The roller, chosen to suit the size of the regions. Metres."""

    radius: float  # of the ball
    width: float  # of the track it covers
    spacing: float  # between strokes
    step: float  # between waypoints
