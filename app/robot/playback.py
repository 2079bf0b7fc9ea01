"""Simulate a robot working through a sequence of regions: plan each region, drive the arm in MuJoCo, report."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from app.geometry.tool import Tool
from app.robot.assessment import off_path, planning_problems, region_report
from app.robot.cell import BODIES, Placement, body_meshes, build_cell
from app.robot.clearance import cloud_of
from app.robot.control import Commands, Runner, Trace, command
from app.robot.parameters import RobotParameters, RollerSize
from app.robot.placement import choose_placement, posture_for
from app.robot.program import DT, FREE, SWEEPING, RegionPlan, plan_region, write_program
from app.robot.raster import Patch, Samples, draw_samples, patch_of
from app.robot.reports import Playback, RegionReport, Report, ignore, playback_from_bytes, playback_to_bytes
from app.robot.routes import runs_over
from app.robot.shells import cells_of
from app.sequencing.problem import check_sequence

__all__ = ["Playback", "RegionReport", "RobotParameters", "playback_from_bytes", "playback_to_bytes", "roller_for", "simulate"]

PLANNED = 0.3  # share of the progress when planning ends
PIECE = 500  # steps between progress reports
TRACK, TRACKS = 0.22, (0.008, 0.08)  # roller width as a share of a typical region's width, and its bounds in metres
CONTACT_N = 1.0  # measured force from which the roller is in contact


@dataclass(frozen=True)
class Work:
    """A tool prepared for the robot."""

    roller: RollerSize
    patches: list[Patch]  # per region
    samples: list[Samples]  # per region
    placement: Placement


def roller_for(areas: Sequence[float]) -> RollerSize:
    """A roller that suits the regions: 30 mm wide on regions of about 130 mm."""
    width = float(np.clip(TRACK * np.sqrt(np.median(areas)), *TRACKS))
    return RollerSize(radius=float(np.clip(0.75 * width, 0.006, 0.022)), width=width, spacing=0.8 * width, step=0.25 * width)


def simulate(tool: Tool, sequence: Sequence[int], parameters: RobotParameters, report: Report = ignore) -> Playback:
    """Let the arm work the regions in order.

    Args:
        tool: Part with labelled regions; its mesh frame becomes the world frame.
        sequence: Every region once.
        parameters: Force, speeds, clearance.
        report: Called with the share done and a sentence.

    Returns:
        Poses over time and a report per region. Regions that can't be worked are named in the reports and left out of the
        motion; the others are done. Equal inputs give equal playbacks.

    Raises:
        IncompleteSequence: Regions are missing or repeated.

    Paper: Sec. VI only says that motions learned from a tracked hand tool are executed; strokes and force law are ours.
    The links do not collide in the physics: collisions are found while planning and told.
    """
    order = check_sequence(sequence, tool.n)
    report(0.0, "Looking for a place for the arm")
    work = _prepare(tool)
    cloud, top = cloud_of(tool), float(tool.mesh.vertices[:, 2].max()) + parameters.clearance
    plans: list[RegionPlan] = []
    problems: list[list[tuple[str, str]]] = []
    before = None
    for k, region in enumerate(order):
        report(PLANNED * k / len(order), f"Planning region {tool.regions[region].name}")
        runs = runs_over(work.patches[region], work.roller) if len(work.patches[region].areas) else []
        plans.append(plan_region(region, runs, work.placement, work.roller, top))
        problems.append(planning_problems(tool, plans[-1], before, work.placement, work.roller, cloud))
        before = plans[-1].passes[-1].leave_q[-1] if plans[-1].passes else before
    commands, trace = _drive(tool, work, plans, parameters, report)
    reports: list[RegionReport] = []
    for plan, found in zip(plans, problems, strict=True):
        name, after = tool.regions[plan.region].name, reports[-1].end_s if reports else 0.0
        reports.append(region_report(name, plan, work.samples[plan.region], work.roller, commands, trace, found, after))
    report(1.0, "Done")
    return _playback(work, parameters, commands, trace, tuple(reports))


def _prepare(tool: Tool) -> Work:
    """Cut the regions out of the mesh, choose roller and place."""
    patches = [patch_of(tool.mesh, tool.labels, k) for k in range(tool.n)]
    roller = roller_for([float(p.areas.sum()) for p in patches if len(p.areas)])
    samples = [draw_samples(p, roller.width) for p in patches]
    return Work(roller, patches, samples, choose_placement(tool, samples, cloud_of(tool, 500), roller.radius))


def _drive(tool: Tool, work: Work, plans: list[RegionPlan], parameters: RobotParameters, report: Report) -> tuple[Commands, Trace]:
    """Run the physics; without any region in reach the arm stays where it is for a second."""
    cells = [cell for plan in plans if plan.passes for cell in cells_of(work.patches[plan.region])]
    model = build_cell(work.placement, cells, work.roller.radius, parameters.spring, DT)
    program = write_program(plans, parameters)
    if not program.q:
        program.rest(posture_for(np.array([[-0.5, 0.0, 0.0]]))[0], np.zeros(3))
    commands = command(program, model, work.placement, work.roller.radius)
    runner = Runner(model, commands, parameters.spring, round(1 / (parameters.log_rate * DT)), [model.body(b).id for b in BODIES])
    for first in range(0, len(commands.q), PIECE):
        region = int(commands.region[first])
        words = f"Working region {tool.regions[region].name}" if region >= 0 else "Moving to the next region"
        report(PLANNED + (1 - PLANNED) * first / len(commands.q), words)
        runner.advance(first, min(first + PIECE, len(commands.q)))
    return commands, runner.trace()


def _playback(work: Work, parameters: RobotParameters, commands: Commands, trace: Trace, reports: tuple[RegionReport, ...]) -> Playback:
    """Thin the trace to the logged moments and sum up."""
    at, touching, sweeping = trace.moments, commands.phase != FREE, commands.phase == SWEEPING
    every = int(at[1] - at[0]) if len(at) > 1 else 1
    smooth = np.convolve(trace.force, np.ones(every) / every)[: len(trace.force)]
    away = np.where(touching, 1000 * off_path(commands, trace), 0.0)
    error = (trace.force - commands.wanted)[sweeping]
    area = np.array([work.patches[r.region].areas.sum() for r in reports])
    single = np.float32
    return Playback(
        times=(at * DT).astype(single), bodies=BODIES, positions=trace.positions.astype(single),
        orientations=trace.orientations.astype(single), body_meshes=body_meshes(work.roller.radius),
        joint_angles=trace.joints.astype(single), force_n=smooth[at].astype(single), off_path_mm=away[at].astype(single),
        region_at=commands.region[at].astype(np.int32), region_reports=reports, cycle_s=float(len(commands.q) * DT),
        in_contact_share=float((touching & (trace.force > CONTACT_N)).mean()), force_target_n=parameters.force_n,
        force_error_n=float(np.sqrt((error**2).mean())) if sweeping.any() else 0.0,
        covered=float(np.average([r.covered for r in reports], weights=area)),
    )  # fmt: skip
