"""From the runs of a region to timed joint motion: approach, slow touch-down, sweep, lift-off, and the way in between."""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from app.geometry.tool import Array
from app.robot import arm
from app.robot.cell import Placement, tool_length
from app.robot.kinematics import Solution, follow, solve
from app.robot.parameters import RobotParameters, RollerSize
from app.robot.placement import posture_for
from app.robot.raster import Stroke
from app.robot.retiming import Timed, retime, transfer

DT = 0.002  # s, of control and physics
ABOVE = 0.05  # m along the normal where an approach turns towards the surface
HOVER = 0.004  # m above the surface where the slow touch-down begins
TOUCH_SPEED = 0.01  # m/s
TOUCH_FORCE = 3.0  # N until the roller has settled
SETTLE_S, RAMP_S, HOLD_S, EASE_S = 0.12, 0.35, 0.1, 0.25
SHORTEST_RUN = 3  # waypoints that a piece of a run cut by the arm's reach needs to be kept
LINE_STEP = 0.008  # m between waypoints in the air
WAY_UP = 0.5  # how far the tool axis turns upright on the way to clearance height
FREE, TOUCHING, SWEEPING = 0, 1, 2  # phases: no force control, force control, counted as work


@dataclass(frozen=True)
class Pass:
    """One run that the arm can follow, with its way in and out."""

    sweep: Stroke
    q: Array  # (K, 6) along the sweep
    entry: Stroke  # from above down to the hover point; the first point is the highest
    entry_q: Array
    leave: Stroke  # from the surface up; the last point is the highest
    leave_q: Array


@dataclass(frozen=True)
class RegionPlan:
    """What the arm can do of one region."""

    region: int
    passes: tuple[Pass, ...]
    planned: int  # waypoints wanted
    reached: int  # waypoints the arm can follow
    farthest_miss_m: float  # over the waypoints that are not reached
    largest_tilt_rad: float


@dataclass
class Program:
    """Everything the controller reads, sampled every DT; lists of blocks until `freeze`."""

    q: list[Array] = field(default_factory=list)
    points: list[Array] = field(default_factory=list)
    normals: list[Array] = field(default_factory=list)
    wanted: list[Array] = field(default_factory=list)
    phase: list[NDArray[np.int8]] = field(default_factory=list)
    region: list[NDArray[np.int32]] = field(default_factory=list)

    def add(self, motion: Timed, wanted: Array | float, phase: int, region: int) -> None:
        k = len(motion.q)
        self.q.append(motion.q)
        self.points.append(motion.points)
        self.normals.append(motion.normals)
        self.wanted.append(np.broadcast_to(np.asarray(wanted, float), (k,)))
        self.phase.append(np.full(k, phase, np.int8))
        self.region.append(np.full(k, region, np.int32))

    def rest(self, q: Array, point: Array) -> None:
        """A second without motion, for a tool of which nothing is in reach."""
        self.add(Timed(q[None], point[None], np.array([[0.0, 0.0, 1.0]])), 0.0, FREE, -1)
        self.hold(np.zeros(int(1 / DT)), FREE, -1)

    def hold(self, wanted: Array, phase: int, region: int) -> None:
        """Stay at the last pose while the wanted force follows the given values."""
        still = [np.repeat(block[-1][-1:], len(wanted), axis=0) for block in (self.q, self.points, self.normals)]
        self.add(Timed(*still), wanted, phase, region)


def plan_region(region: int, runs: list[Stroke], placement: Placement, roller: RollerSize, top: float) -> RegionPlan:
    """Solve the joint angles of all runs; waypoints the arm can't reach cut a run or drop it.

    Args:
        runs: Waypoints in the tool frame.
        top: Height of the clearance plane, metres in the tool frame.
    """
    planned = sum(len(r.points) for r in runs)
    if not planned:
        return RegionPlan(region, (), 0, 0, 0.0, 0.0)
    passes: list[Pass] = []
    reached, miss, tilt = 0, 0.0, 0.0
    start = _start(runs, placement, roller)
    for run in runs:
        solution = _follow(run, placement, roller, start)
        good = solution.reached
        miss = max(miss, float(solution.miss_m[~good].max(initial=0.0)))
        tilt = max(tilt, float(solution.tilt_rad[~good].max(initial=0.0)))
        for piece in _pieces(good):
            made = _pass(Stroke(run.points[piece], run.normals[piece]), solution.q[piece], placement, roller, top)
            if made is not None:
                passes.append(made)
                reached += piece.stop - piece.start
                start = made.q[-1]
    return RegionPlan(region, tuple(passes), planned, reached, miss, tilt)


def _start(runs: list[Stroke], placement: Placement, roller: RollerSize) -> Array:
    """Joint angles near which the region begins: the home posture led to the first waypoint in reach."""
    points = np.concatenate([r.points for r in runs])[:: max(1, sum(len(r.points) for r in runs) // 40)]
    normals = np.concatenate([r.normals for r in runs])[:: max(1, sum(len(r.points) for r in runs) // 40)]
    local, turned = placement.points_to_base(points), placement.vectors_to_base(normals)
    solution = solve(local, turned, posture_for(local), tool_length(roller.radius), posture_for(local))
    return solution.q[int(np.argmax(solution.reached))] if solution.reached.any() else posture_for(local[:1])[0]


def _follow(stroke: Stroke, placement: Placement, roller: RollerSize, start: Array) -> Solution:
    """The stroke's joint angles; waypoints beyond the sphere of reach are not tried."""
    local, normals = placement.points_to_base(stroke.points), placement.vectors_to_base(stroke.normals)
    flange = local + normals * (tool_length(roller.radius) + arm.D[5])
    beyond = np.linalg.norm(flange - [0, 0, arm.D[0]], axis=1) - arm.REACH
    tried = beyond < 0
    q, miss, tilt = np.tile(start, (len(local), 1)), np.maximum(beyond, 1e-3), np.zeros(len(local))
    if tried.any():
        first = solve(local[tried][:1], normals[tried][:1], start[None], tool_length(roller.radius), start, 100)
        begin = first.q[0] if first.reached[0] else start
        part = follow(local[tried], normals[tried], begin, tool_length(roller.radius), posture_for(local.mean(axis=0)[None])[0])
        q[tried], miss[tried], tilt[tried] = part.q, part.miss_m, part.tilt_rad
    return Solution(q, miss, tilt)


def _pieces(good: NDArray[np.bool_]) -> list[slice]:
    """Stretches of consecutive reached waypoints."""
    if good.all():
        return [slice(0, len(good))]
    edge = np.flatnonzero(np.diff(np.concatenate([[0], good.astype(np.int8), [0]])))
    return [slice(int(a), int(b)) for a, b in zip(edge[::2], edge[1::2], strict=True) if b - a >= SHORTEST_RUN]


def _pass(sweep: Stroke, q: Array, placement: Placement, roller: RollerSize, top: float) -> Pass | None:
    """Add the way in and out; None when not even the hover point can be reached."""
    entry = _way_up(sweep.points[0], sweep.normals[0], top)
    leave = _way_up(sweep.points[-1], sweep.normals[-1], top)
    up, away = _reachable(entry, q[0], placement, roller), _reachable(leave, q[-1], placement, roller)
    if up < 2 or away < 2:
        return None
    entry_q, leave_q = (_solve_line(line, n, start, placement, roller) for line, n, start in ((entry, up, q[0]), (leave, away, q[-1])))
    back = Stroke(entry.points[:up][::-1], entry.normals[:up][::-1])
    return Pass(sweep, q, back, entry_q[::-1], Stroke(leave.points[:away], leave.normals[:away]), leave_q)


def _way_up(point: Array, normal: Array, top: float) -> Stroke:
    """From the hover point along the normal, then straight up to the clearance height."""
    out = np.linspace(HOVER, ABOVE, 7)[:, None]
    above = point + normal * ABOVE
    rise = max(0.0, top - float(above[2]))
    share = np.linspace(0, 1, int(np.ceil(rise / LINE_STEP)) + 1)[1:, None]
    upright = normal + np.array([0.0, 0.0, 1.0]) * WAY_UP * (1 if normal[2] > -0.5 else 0)
    turned = normal * (1 - share) + upright / np.linalg.norm(upright) * share
    normals = np.concatenate([np.repeat(normal[None], 7, axis=0), turned / np.linalg.norm(turned, axis=1, keepdims=True)])
    return Stroke(np.concatenate([point + normal * out, above + np.array([0.0, 0.0, rise]) * share]), normals)


def _reachable(line: Stroke, start: Array, placement: Placement, roller: RollerSize) -> int:
    """How many waypoints of the line can be followed from its beginning."""
    good = _follow(line, placement, roller, start).reached
    return len(good) if good.all() else int(np.argmin(good))


def _solve_line(line: Stroke, count: int, start: Array, placement: Placement, roller: RollerSize) -> Array:
    return _follow(Stroke(line.points[:count], line.normals[:count]), placement, roller, start).q


def write_program(plans: list[RegionPlan], parameters: RobotParameters) -> Program:
    """All passes of all regions in order, with the transfers between them."""
    program = Program()
    ramp = np.linspace(TOUCH_FORCE, parameters.force_n, int(RAMP_S / DT))
    down = np.concatenate([np.full(int(SETTLE_S / DT), TOUCH_FORCE), ramp, np.full(int(HOLD_S / DT), parameters.force_n)])
    ease = np.linspace(parameters.force_n, TOUCH_FORCE, int(EASE_S / DT))
    for plan in plans:
        for number, step in enumerate(plan.passes):
            if program.q:
                _transfer(program, step, plan.region if number else -1, parameters)
            entry = retime(step.entry_q, step.entry.points, step.entry.normals, parameters.transfer_speed / 2, DT)
            program.add(entry, 0.0, FREE, plan.region)
            touch = _joined(step.entry_q, step.entry, step.q[:1], _first(step.sweep))
            program.add(retime(*touch, TOUCH_SPEED, DT), 0.0, FREE, plan.region)
            program.hold(down, TOUCHING, plan.region)
            sweep = retime(step.q, step.sweep.points, step.sweep.normals, parameters.tip_speed, DT)
            program.add(sweep, parameters.force_n, SWEEPING, plan.region)
            program.hold(ease, TOUCHING, plan.region)
            leave = _joined(step.q, step.sweep, step.leave_q, step.leave)
            program.add(retime(*leave, parameters.transfer_speed / 2, DT), 0.0, FREE, plan.region)
    return program


def _first(stroke: Stroke) -> Stroke:
    return Stroke(stroke.points[:1], stroke.normals[:1])


def _joined(q: Array, stroke: Stroke, after_q: Array, after: Stroke) -> tuple[Array, Array, Array]:
    """Joint angles, points and normals from the last waypoint of `stroke` through all of `after`."""
    pairs = ((q, after_q), (stroke.points, after.points), (stroke.normals, after.normals))
    joined = [np.concatenate([last[-1:], following]) for last, following in pairs]
    return joined[0], joined[1], joined[2]


def _transfer(program: Program, step: Pass, region: int, parameters: RobotParameters) -> None:
    """Joint motion from the last pose to the next entry."""
    start, here, normal = program.q[-1][-1], program.points[-1][-1], program.normals[-1][-1]
    q = transfer(start, step.entry_q[0], float(np.linalg.norm(step.entry.points[0] - here)), parameters.transfer_speed, DT)
    share = np.linspace(0, 1, len(q))[:, None]
    normals = normal * (1 - share) + step.entry.normals[0] * share
    points = here + (step.entry.points[0] - here) * share
    program.add(Timed(q, points, normals / np.linalg.norm(normals, axis=1, keepdims=True)), 0.0, FREE, region)
