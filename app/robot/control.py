"""Position servos with admittance along the normal: the commanded offset integrates the force error at 500 Hz."""

# mujoco is a compiled module without type stubs: its names are unknown to the checker
# pyright: reportAttributeAccessIssue=false

from dataclasses import dataclass

import mujoco
import numpy as np
from numpy.typing import NDArray

from app.geometry.tool import Array
from app.robot import arm
from app.robot.cell import Placement, servo_numbers, tool_length
from app.robot.kinematics import TILT_WEIGHT
from app.robot.program import DT, FREE, Program

DAMPING = 300.0  # N s/m of the admittance; lower follows faster and rings sooner
FASTEST = 0.05  # m/s of the offset
OFFSETS = (-0.01, 0.03)  # m the offset may take
CUTOFF_HZ = 40.0  # of the force filter
LATCH_N = 1.5  # measured force at which the roller counts as touching
FORGET = 0.99  # per step: the offset fades once the roller has left the surface
TARE_STEPS = 200
CHUNK = 4000  # samples per batch of Jacobians


@dataclass(frozen=True)
class Commands:
    """The program as plain arrays of K steps, with what the force law needs precomputed."""

    q: Array  # (K, 6)
    feed: Array  # (K, 6) servo targets without contact: q plus the lag of the speed
    points: Array  # (K, 3) tool frame
    normals: Array  # (K, 3)
    acceleration: Array  # (K, 6) rad/s^2
    wanted: Array  # (K,) N
    phase: NDArray[np.int8]
    region: NDArray[np.int32]
    press: Array  # (K, 6) joint change per metre of push against the normal, tool axis kept
    sag: Array  # (K, 6) joint change that makes up for one newton along the normal


@dataclass(frozen=True)
class Trace:
    """What was measured at each of the K steps; poses only every `every`-th."""

    force: Array  # (K,) N along the normal, tared
    tip: Array  # (K, 3) m
    moments: NDArray[np.int64]  # (T,) steps at which the poses below were stored
    positions: Array  # (T, B, 3)
    orientations: Array  # (T, B, 4)
    joints: Array  # (T, 6)


def command(program: Program, model: mujoco.MjModel, placement: Placement, radius: float) -> Commands:
    """Join the program's blocks and work out the feed-forward terms."""
    q, points, normals = (np.concatenate(b) for b in (program.q, program.points, program.normals))
    stiffness, damping = servo_numbers(model)
    speed = np.gradient(q, DT, axis=0) if len(q) > 1 else np.zeros_like(q)
    press, sag = np.empty_like(q), np.empty_like(q)
    local = placement.vectors_to_base(normals)
    for k in range(0, len(q), CHUNK):
        part = slice(k, k + CHUNK)
        frames = arm.forward(q[part])
        linear, angular = arm.jacobian(frames, tool_length(radius))
        across = frames.rotations[5][:, :, :2].transpose(0, 2, 1)
        rows = np.concatenate([linear, TILT_WEIGHT * across @ angular], axis=1)
        push = np.concatenate([-local[part], np.zeros((len(linear), 2))], axis=1)[:, :, None]
        gram = rows @ rows.transpose(0, 2, 1) + 1e-7 * np.eye(5)
        press[part] = (rows.transpose(0, 2, 1) @ np.linalg.solve(gram, push))[:, :, 0]
        sag[part] = np.einsum("pij,pi->pj", linear, local[part]) / stiffness
    wanted, phase, region = np.concatenate(program.wanted), np.concatenate(program.phase), np.concatenate(program.region)
    acceleration = np.gradient(speed, DT, axis=0) if len(q) > 1 else speed
    return Commands(q, q + speed * damping / stiffness, points, normals, acceleration, wanted, phase, region, press, sag)


class Runner:
    """Steps the physics through the commands; `advance` may be called in pieces so that progress can be told."""

    def __init__(self, model: mujoco.MjModel, commands: Commands, spring: float, every: int, bodies: list[int]) -> None:
        self._model, self._data, self._commands, self._spring = model, mujoco.MjData(model), commands, spring
        self._bodies, self._every = bodies, every
        count = len(commands.q)
        stored = len(range(0, count, every))
        self._force, self._tip = np.zeros(count), np.zeros((count, 3))
        self._positions, self._orientations = np.zeros((stored, len(bodies), 3)), np.zeros((stored, len(bodies), 4))
        self._joints = np.zeros((stored, 6))
        self._offset = self._filtered = 0.0
        self._latched = False
        self._stiffness, self._inertial, self._full = servo_numbers(model)[0], np.zeros(model.nv), np.zeros(model.nv)
        self._sensor, self._tcp = model.site("sensor").id, model.site("tcp").id
        self._data.qpos[:6] = self._data.ctrl[:6] = commands.q[0]
        mujoco.mj_step(model, self._data, TARE_STEPS)
        self._tare = self._world_force()  # weight does not turn with the flange: tared in the world frame

    def _world_force(self) -> Array:
        return self._data.site_xmat[self._sensor].reshape(3, 3) @ self._data.sensordata[:3]

    def advance(self, first: int, last: int) -> None:
        """Simulate steps first..last - 1."""
        model, data, tip = self._model, self._data, self._tcp
        for k in range(first, last):
            data.ctrl[:6] = self._targets(k) + self._inertia(k)
            if k % self._every == 0:  # after a step, poses still belong to the joint angles before it
                self._joints[k // self._every] = data.qpos[:6]
            mujoco.mj_step(model, data)
            self._tip[k] = data.site_xpos[tip]
            if k % self._every == 0:
                row = k // self._every
                self._positions[row], self._orientations[row] = data.xpos[self._bodies], data.xquat[self._bodies]

    def _inertia(self, k: int) -> Array:
        """Change of the servo targets that yields the torque the planned acceleration needs."""
        self._full[:6] = self._commands.acceleration[k]
        mujoco.mj_mulM(self._model, self._data, self._inertial, self._full)
        return self._inertial[:6] / self._stiffness

    def _targets(self, k: int) -> Array:
        """Servo targets: admittance, spring travel and joint sag for the wanted force, only where the roller may touch."""
        commands = self._commands
        measured = -float((self._world_force() - self._tare) @ commands.normals[k])
        self._force[k] = measured
        self._filtered += (measured - self._filtered) * min(1.0, DT * 2 * np.pi * CUTOFF_HZ)
        if commands.phase[k] == FREE:
            self._latched = False
            self._offset *= FORGET
            return commands.feed[k] + commands.press[k] * self._offset
        wanted = float(commands.wanted[k])
        self._latched = self._latched or self._filtered > LATCH_N
        rate = min(FASTEST, max(-FASTEST, (wanted - self._filtered) / DAMPING))
        self._offset = min(OFFSETS[1], max(OFFSETS[0], self._offset + rate * DT))
        if not self._latched:
            return commands.feed[k] + commands.press[k] * self._offset
        return commands.feed[k] + commands.press[k] * (self._offset + wanted / self._spring) - commands.sag[k] * wanted

    def trace(self) -> Trace:
        """Everything measured."""
        moments = np.arange(0, len(self._force), self._every)
        return Trace(self._force, self._tip, moments, self._positions, self._orientations, self._joints)
