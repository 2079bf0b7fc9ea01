"""A six-axis arm with 1.3 m reach, from its Denavit-Hartenberg numbers; link shapes are capsules, nothing is loaded.

Frames: `base` at the foot of the arm, z up; link i turns about z of frame i - 1. Lengths in metres, angles in radians.
"""

from dataclasses import dataclass

import numpy as np

from app.geometry.tool import Array

NAME = "six-axis arm, 1.3 m reach"
JOINTS = ("shoulder pan", "shoulder lift", "elbow", "wrist 1", "wrist 2", "wrist 3")
A = (0.0, -0.6127, -0.57155, 0.0, 0.0, 0.0)
D = (0.1807, 0.0, 0.0, 0.17415, 0.11985, 0.11655)
ALPHA = (np.pi / 2, 0.0, 0.0, np.pi / 2, -np.pi / 2, 0.0)
LIMIT = np.array([2 * np.pi, 2 * np.pi, np.pi, 2 * np.pi, 2 * np.pi, 2 * np.pi])  # +- rad
SPEED = np.radians([120.0, 120.0, 180.0, 180.0, 180.0, 180.0])  # rad/s
TORQUE = (330.0, 330.0, 150.0, 56.0, 56.0, 56.0)  # N m
MASS = (7.369, 13.051, 3.989, 2.1, 1.98, 0.615)  # kg
HOME = np.array([0.0, -1.3, 1.9, -2.17, -np.pi / 2, 0.0])  # the tool points down in front of the arm (towards -x of the base)
REACH = 1.3  # m from the shoulder


@dataclass(frozen=True)
class Capsule:
    """A line with a radius, fixed in a body's frame."""

    body: str
    start: tuple[float, float, float]
    end: tuple[float, float, float]
    radius: float


CAPSULES = (
    Capsule("shoulder", (0, 0, 0.05), (0, 0, D[0]), 0.075),
    Capsule("upper arm", (0, 0, 0), (0, 0, 0.176), 0.07),
    Capsule("upper arm", (0, 0, 0.176), (A[1], 0, 0.176), 0.06),
    Capsule("forearm", (0, 0, 0.176), (0, 0, 0.039), 0.058),
    Capsule("forearm", (0, 0, 0.039), (A[2], 0, 0.039), 0.045),
    Capsule("wrist 1", (0, 0, 0.039), (0, 0, D[3]), 0.045),
    Capsule("wrist 2", (0, 0, 0), (0, 0, D[4]), 0.045),
    Capsule("wrist 3", (0, 0, 0), (0, 0, 0.09), 0.042),
)
LINKS = ("shoulder", "upper arm", "forearm", "wrist 1", "wrist 2", "wrist 3")  # body i is turned by joint i


def mounting(i: int) -> tuple[tuple[float, float, float], float]:
    """Where body i sits in body i - 1 before its joint turns it: position, and the angle about x."""
    return ((0.0, 0.0, 0.0), 0.0) if i == 0 else ((A[i - 1], 0.0, D[i - 1]), ALPHA[i - 1])


@dataclass(frozen=True)
class Frames:
    """Poses of P arms in the base frame."""

    origins: Array  # (6, P, 3) of the link bodies, each turned by its joint
    rotations: Array  # (6, P, 3, 3)


def forward(q: Array) -> Frames:
    """Link poses for joint angles (P, 6)."""
    count = len(q)
    origin, rotation = np.zeros((count, 3)), np.broadcast_to(np.eye(3), (count, 3, 3))
    origins, rotations = np.empty((6, count, 3)), np.empty((6, count, 3, 3))
    cos, sin = np.cos(q), np.sin(q)
    for i in range(6):
        position, angle = mounting(i)
        origin = origin + rotation @ np.array(position)
        ca, sa = np.cos(angle), np.sin(angle)
        turn = np.zeros((count, 3, 3))  # about x by `angle`, then about z by q
        turn[:, 0, 0], turn[:, 0, 1] = cos[:, i], -sin[:, i]
        turn[:, 1, 0], turn[:, 1, 1], turn[:, 1, 2] = ca * sin[:, i], ca * cos[:, i], -sa
        turn[:, 2, 0], turn[:, 2, 1], turn[:, 2, 2] = sa * sin[:, i], sa * cos[:, i], ca
        rotation = rotation @ turn
        origins[i], rotations[i] = origin, rotation
    return Frames(origins, rotations)


def tip(frames: Frames, length: float) -> Array:
    """Tool tip (P, 3), `length` beyond the flange along its z."""
    return frames.origins[5] + frames.rotations[5, :, :, 2] * (D[5] + length)


def jacobian(frames: Frames, length: float) -> tuple[Array, Array]:
    """Derivatives of the tool tip's position and rotation by the joints, each (P, 3, 6), base frame."""
    axes = frames.rotations[:, :, :, 2].transpose(1, 2, 0)
    arms = (tip(frames, length) - frames.origins).transpose(1, 2, 0)
    return cross(axes, arms), axes


def cross(a: Array, b: Array) -> Array:
    """Cross product along axis 1; np.cross spends most of its time on checks for few rows."""
    product = np.empty(np.broadcast_shapes(a.shape, b.shape))
    product[:, 0] = a[:, 1] * b[:, 2] - a[:, 2] * b[:, 1]
    product[:, 1] = a[:, 2] * b[:, 0] - a[:, 0] * b[:, 2]
    product[:, 2] = a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]
    return product
