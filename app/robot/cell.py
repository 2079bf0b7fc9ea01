"""The MuJoCo scene: arm, spring-mounted roller and the tool's working surface. The world frame is the tool frame."""

# mujoco is a compiled module without type stubs: its names are unknown to the checker
# pyright: reportAttributeAccessIssue=false

from collections.abc import Iterable
from dataclasses import dataclass
from typing import cast

import mujoco
import numpy as np
import trimesh
from numpy.typing import NDArray

from app.geometry.tool import Array
from app.robot import arm
from app.robot.reports import Faces, Floats

STEM = 0.15  # m from the flange to the centre of the roller
SERVO_GAIN = (20000.0, 20000.0, 12000.0, 5000.0, 5000.0, 5000.0)  # N m/rad
JOINT_DAMPING = (10.0, 10.0, 5.0, 2.0, 2.0, 2.0)  # N m s/rad
CARRIAGE_MASS, ROLLER_MASS = 0.15, 0.2  # kg
SOFT = {"solref": [0.01, 1.0], "solimp": [0.5, 0.9, 0.0005, 0.5, 2.0]}  # stiffer contact chatters on facets
FRICTION = [0.1, 0.002, 0.0001]
BODIES = ("base", *arm.LINKS, "flange", "carriage", "roller")
PEDESTAL = 0.4  # m of column drawn below the arm


@dataclass(frozen=True)
class Placement:
    """Where the arm's base stands in the tool frame."""

    position: Array  # (3,) metres
    yaw: float  # rad about z

    @property
    def rotation(self) -> Array:
        c, s = np.cos(self.yaw), np.sin(self.yaw)
        return np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])

    def points_to_base(self, points: Array) -> Array:
        return (points - self.position) @ self.rotation

    def points_to_tool(self, points: Array) -> Array:
        return points @ self.rotation.T + self.position

    def vectors_to_base(self, vectors: Array) -> Array:
        return vectors @ self.rotation


def tool_length(radius: float) -> float:
    """From the flange to the point of the roller that touches."""
    return STEM + radius


def build_cell(placement: Placement, cells: Iterable[Array], radius: float, spring: float, dt: float) -> mujoco.MjModel:
    """Compile the scene; `cells` are corner points of convex bodies in the tool frame."""
    spec = mujoco.MjSpec()
    spec.compiler.degree = False  # the default True would read radian ranges as degrees, silently
    spec.option.timestep = dt
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    spec.option.cone = mujoco.mjtCone.mjCONE_ELLIPTIC
    spec.option.jacobian = mujoco.mjtJacobian.mjJAC_DENSE  # mujoco 4.0.0 has a known fault with sparse ones
    _add_roller(_add_arm(spec, placement), radius, spring)
    for i, points in enumerate(cells):
        mesh = spec.add_mesh(name=f"cell {i}")
        mesh.uservert = points.ravel()
        spec.worldbody.add_geom(type=mujoco.mjtGeom.mjGEOM_MESH, meshname=f"cell {i}", contype=1, conaffinity=2)
    for name in BODIES:
        spec.body(name).gravcomp = 1
    for i, name in enumerate(arm.JOINTS):
        servo = spec.add_actuator(name=name, target=name, trntype=mujoco.mjtTrn.mjTRN_JOINT)
        servo.forcerange, servo.forcelimited = [-arm.TORQUE[i], arm.TORQUE[i]], 1
        servo.set_to_position(kp=SERVO_GAIN[i], dampratio=1.0)
    spec.add_sensor(name="force", type=mujoco.mjtSensor.mjSENS_FORCE, objtype=mujoco.mjtObj.mjOBJ_SITE, objname="sensor")
    return spec.compile()


def _add_arm(spec: mujoco.MjSpec, placement: Placement) -> mujoco.MjsBody:
    half = placement.yaw / 2
    body = spec.worldbody.add_body(name="base", pos=placement.position, quat=[np.cos(half), 0, 0, np.sin(half)])
    for i, name in enumerate(arm.LINKS):
        position, angle = arm.mounting(i)
        body = body.add_body(name=name, pos=list(position), quat=[np.cos(angle / 2), np.sin(angle / 2), 0, 0])
        joint = body.add_joint(name=arm.JOINTS[i], type=mujoco.mjtJoint.mjJNT_HINGE, axis=[0, 0, 1])
        joint.range, joint.limited, joint.armature = [-arm.LIMIT[i], arm.LIMIT[i]], 1, 0.1
        joint.damping = [JOINT_DAMPING[i], 0, 0]  # linear, then polynomial terms
        capsules = [c for c in arm.CAPSULES if c.body == name]
        for c in capsules:
            body.add_geom(type=mujoco.mjtGeom.mjGEOM_CAPSULE, fromto=[*c.start, *c.end], size=[c.radius, 0, 0],
                          mass=arm.MASS[i] / len(capsules), contype=0, conaffinity=0)  # fmt: skip
    return body.add_body(name="flange", pos=[0, 0, arm.D[5]])


def _add_roller(flange: mujoco.MjsBody, radius: float, spring: float) -> None:
    """Force sensor at the flange, a slide with a spring, the roller; the site `tcp` is the roller's lowest point."""
    kind = mujoco.mjtGeom
    flange.add_site(name="sensor")
    flange.add_geom(type=kind.mjGEOM_CYLINDER, fromto=[0, 0, 0, 0, 0, 0.03], size=[0.032, 0, 0], mass=0.3, contype=0, conaffinity=0)
    carriage = flange.add_body(name="carriage")
    damping = 2 * 0.7 * np.sqrt(spring * (CARRIAGE_MASS + ROLLER_MASS))
    slide = carriage.add_joint(name="slide", type=mujoco.mjtJoint.mjJNT_SLIDE, axis=[0, 0, 1])
    slide.stiffness, slide.damping, slide.range, slide.limited = [spring, 0, 0], [damping, 0, 0], [-0.03, 0.03], 1
    carriage.add_geom(type=kind.mjGEOM_CAPSULE, fromto=[0, 0, 0.03, 0, 0, STEM - 0.01], size=[0.012, 0, 0], mass=CARRIAGE_MASS,
                      contype=0, conaffinity=0)  # fmt: skip
    carriage.add_site(name="tcp", pos=[0, 0, STEM + radius])
    roller = carriage.add_body(name="roller", pos=[0, 0, STEM])
    # priority 1: otherwise the larger friction of the two bodies would win
    roller.add_geom(name="roller", type=kind.mjGEOM_SPHERE, size=[radius, 0, 0], mass=ROLLER_MASS, contype=2, conaffinity=1,
                    condim=3, friction=FRICTION, priority=1, **SOFT)  # fmt: skip


def body_meshes(radius: float) -> tuple[tuple[Floats, Faces], ...]:
    """What to draw for each of BODIES, in the body's frame."""
    shapes: dict[str, list[trimesh.Trimesh]] = {name: [] for name in BODIES}
    shapes["base"].append(_column([0, 0, -PEDESTAL], [0, 0, 0.05], 0.09))
    for c in arm.CAPSULES:
        shapes[c.body].append(_capsule(np.array(c.start, float), np.array(c.end, float), c.radius))
    shapes["flange"].append(_column([0, 0, -0.02], [0, 0, 0.03], 0.032))
    shapes["carriage"].append(_column([0, 0, 0.03], [0, 0, STEM], 0.012))
    shapes["roller"].append(trimesh.creation.icosphere(subdivisions=2, radius=radius))
    joined = [cast(trimesh.Trimesh, trimesh.util.concatenate(shapes[name])) for name in BODIES]
    return tuple((np.asarray(m.vertices, np.float32), np.asarray(m.faces, np.int32)) for m in joined)


def _column(start: list[float], end: list[float], radius: float) -> trimesh.Trimesh:
    return trimesh.creation.cylinder(radius=radius, segment=[start, end], sections=20)


def _capsule(start: Array, end: Array, radius: float) -> trimesh.Trimesh:
    mesh = trimesh.creation.capsule(height=float(np.linalg.norm(end - start)), radius=radius, count=[10, 14])
    mesh.apply_transform(trimesh.geometry.align_vectors([0, 0, 1], end - start))
    mesh.apply_translation((start + end) / 2 - mesh.bounds.mean(axis=0))
    return mesh


def servo_numbers(model: mujoco.MjModel) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Stiffness and damping of the position servos, (6,) each."""
    return model.actuator_gainprm[:6, 0].copy(), -model.actuator_biasprm[:6, 2].copy()
