"""What a person should know of each region: measured force and path, coverage, and problems in plain sentences."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from app.geometry.tool import Array, Tool
from app.robot import arm
from app.robot.cell import Placement, tool_length
from app.robot.clearance import Cloud, Touch, deepest_touch
from app.robot.control import Commands, Trace
from app.robot.kinematics import stiffness_to_singular
from app.robot.parameters import RollerSize
from app.robot.program import DT, FREE, SWEEPING, RegionPlan
from app.robot.raster import Samples, coverage
from app.robot.reports import RegionReport

NEAR_LIMIT = np.radians(5.0)
NEAR_SINGULAR = 0.02  # smallest singular value (m/rad, tilt weighted); the home pose has 0.15
PRESSED = 0.25  # share of the wanted force from which the roller counts as working
LOST_N, LOST_SHARE = 1.0, 0.02
HARDEST, ROUGHEST = 1.35, 0.10  # shares of the wanted force: highest measured force, root mean square of its error while sweeping
PUSHED_OFF_MM = 2.0  # measured distance from the path from which something other than control is in the way
COVERED_ENOUGH = 0.9
POSES_CHECKED = 60  # per region for collisions

Problem = tuple[str, str]


def off_path(commands: Commands, trace: Trace) -> Array:
    """Distance of the tip from the planned point in the tangent plane, metres, (K,)."""
    miss = trace.tip - commands.points
    normal = commands.normals
    return np.linalg.norm(miss - normal * np.einsum("ki,ki->k", miss, normal)[:, None], axis=1)


def planning_problems(
    tool: Tool, plan: RegionPlan, before: Array | None, placement: Placement, roller: RollerSize, cloud: Cloud
) -> list[Problem]:
    """Reach, joint limits, singular poses and collisions of one region; `before` are the joint angles the arm comes from."""
    name = tool.regions[plan.region].name
    problems = _reach_problems(name, plan)
    if not plan.passes:
        return problems
    q = np.concatenate([np.concatenate([p.entry_q, p.q, p.leave_q]) for p in plan.passes])
    problems += _limit_problems(name, q)
    weakest = float(stiffness_to_singular(q, tool_length(roller.radius)).min())
    if weakest < NEAR_SINGULAR:
        bent = "wrist 2 nearly straight" if np.abs(np.sin(q[:, 4])).min() < 0.15 else "the arm nearly stretched out"
        problems.append(("singular", f"Region {name} is worked with {bent}: close to a singular pose, where joints turn fast."))
    poses = {"while working": q[:: max(1, len(q) // POSES_CHECKED)]}
    if before is not None:
        poses["on the way to"] = before + (q[0] - before) * np.linspace(0, 1, 12)[:, None]
    for when, posed in poses.items():
        touch = deepest_touch(posed, placement, cloud)
        if touch is not None:
            problems.append(("collision", _collision_sentence(tool, touch, f"{when} region {name}")))
    return problems


def _reach_problems(name: str, plan: RegionPlan) -> list[Problem]:
    """A sentence when some of the region can't be reached."""
    if plan.planned == 0:
        return [("reach", f"Region {name} is too small for the roller.")]
    if plan.reached == plan.planned:
        return []
    share = 1 - plan.reached / plan.planned
    part = "" if share > 0.995 else f" on {max(1, round(100 * share))} % of its strokes"
    if plan.farthest_miss_m >= 0.005:
        far = f"{100 * plan.farthest_miss_m:.0f} cm" if plan.farthest_miss_m >= 0.01 else "1 cm"
        return [("reach", f"Region {name} is out of reach by {far}{part}.")]
    if plan.largest_tilt_rad > np.radians(0.5):
        short = f"{np.degrees(plan.largest_tilt_rad):.0f} degrees short"
        return [("reach", f"Region {name} can't be worked with the roller upright on the surface{part}: {short}.")]
    return [("reach", f"Region {name} leaves no room to approach it{part}.")]


def _limit_problems(name: str, q: Array) -> list[Problem]:
    """Joints that come near the end of their range."""
    margin = (arm.LIMIT - np.abs(q)).min(axis=0)
    problems = []
    for j in np.flatnonzero(margin < NEAR_LIMIT):
        degrees = max(1, int(np.ceil(np.degrees(margin[j]))))
        amount = "1 degree" if degrees == 1 else f"{degrees} degrees"
        problems.append(("limit", f"Region {name}: {arm.JOINTS[j]} comes within {amount} of its limit."))
    return problems


def _collision_sentence(tool: Tool, touch: Touch, when: str) -> str:
    """Which link would touch what, and how deep."""
    link = touch.body.capitalize() if touch.body.startswith("wrist") else f"The {touch.body}"
    if isinstance(touch.other, str):
        return f"{link} would touch the {touch.other} {when}, by {1000 * touch.depth:.0f} mm."
    other = "the part" if touch.other < 0 else f"region {tool.regions[touch.other].name}"
    return f"{link} would touch {other} {when}, by {1000 * touch.depth:.0f} mm."


def region_report(
    name: str, plan: RegionPlan, samples: Samples, roller: RollerSize, commands: Commands, trace: Trace, found: list[Problem], after: float
) -> RegionReport:
    """Measured numbers of one region; `after` is the time the one before it ended, used where nothing was done."""
    mine = commands.region == plan.region
    if not mine.any():
        return RegionReport(plan.region, after, after, 0.0, 0.0, 0.0, 0.0, tuple(found))
    when = np.flatnonzero(mine) * DT
    touching, sweeping = mine & (commands.phase != FREE), mine & (commands.phase == SWEEPING)
    error = trace.force[sweeping] - commands.wanted[sweeping]
    report = RegionReport(
        plan.region, float(when[0]), float(when[-1] + DT), float(np.sqrt((error**2).mean())), float(trace.force[mine].max()),
        float(1000 * off_path(commands, trace)[touching].max()),
        coverage(samples, *_pressed(commands, trace, touching), roller.width), (),
    )  # fmt: skip
    problems, lost = list(found), float((trace.force[sweeping] < LOST_N).mean())
    if lost > LOST_SHARE:
        problems.append(("contact", f"The roller loses contact on {round(100 * lost)} % of region {name}."))
    problems += measured_problems(name, report, float(commands.wanted[touching].max()), plan.reached == plan.planned)
    return replace(report, problems=tuple(problems))


def measured_problems(name: str, report: RegionReport, wanted: float, all_reached: bool) -> list[Problem]:
    """What the measured numbers of a region that was worked say against it.

    Args:
        name: Of the region.
        report: Its measured numbers; the problems in it are not read.
        wanted: Force asked for, N.
        all_reached: Whether the arm could follow every stroke; if not, that is told elsewhere as the reason of poor coverage.
    """
    problems: list[Problem] = []
    if report.force_max_n > HARDEST * wanted:
        pressed = f"the roller pressed with {report.force_max_n:.0f} N where {wanted:g} N were wanted"
        problems.append(("contact", f"Region {name}: {pressed}."))
    if report.force_rms_n > ROUGHEST * wanted:
        unsteady = f"the force is unsteady, {report.force_rms_n:.1f} N (root mean square) off the {wanted:g} N wanted"
        problems.append(("contact", f"Region {name}: {unsteady}."))
    if report.off_path_max_mm > PUSHED_OFF_MM:
        pushed = f"the roller is pushed {report.off_path_max_mm:.1f} mm off its path, as where it does not fit between the surfaces"
        problems.append(("contact", f"Region {name}: {pushed}."))
    if report.covered < COVERED_ENOUGH:
        why = ": it is narrow or strongly curved for the roller" if all_reached else ""
        problems.append(("coverage", f"Only {np.floor(100 * report.covered):.0f} % of region {name} is covered{why}."))
    return problems


def _pressed(commands: Commands, trace: Trace, touching: NDArray[np.bool_]) -> tuple[Array, Array]:
    """Where the roller worked: points and normals, thinned."""
    at = np.flatnonzero(touching & (trace.force > PRESSED * commands.wanted.max()))[::5]
    return trace.tip[at], commands.normals[at]
