"""The same chain in engines nobody here wrote: MuJoCo and Pinocchio."""

from dataclasses import dataclass
from typing import Any

import mujoco
import numpy as np
import pinocchio

from model.kinematics.chain import Chain, FloatArray, Joint, JointKind, Link


@dataclass(frozen=True)
class Terms:
    """D, H + G, G and the energies of one state, as an oracle gives them."""

    inertia: FloatArray
    bias: FloatArray
    gravity: FloatArray
    kinetic: float
    potential: float


def mjcf(chain: Chain) -> str:
    """MJCF of a chain: one body a link, in the axes of its D-H frame, contacts and damping absent."""
    bodies, closing = [], []
    for number, (joint, link) in enumerate(zip(chain.joints, _loaded_links(chain), strict=True), start=1):
        rotation, position = _fixed_part(joint)
        axis, anchor = rotation.T @ [0, 0, 1], -rotation.T @ position
        kind = "hinge" if joint.kind is JointKind.REVOLUTE else "slide"
        i = link.inertia
        full = (i[0, 0], i[1, 1], i[2, 2], i[0, 1], i[0, 2], i[1, 2])
        x, y = rotation[:, 0], rotation[:, 1]
        bodies.append(
            f'<body name="link{number}" pos="{_text(position)}" xyaxes="{_text((*x, *y))}">'
            f'<joint type="{kind}" axis="{_text(axis)}" pos="{_text(anchor)}" armature="{joint.rotor_inertia!r}"/>'
            f'<inertial pos="{_text(link.centre_of_mass)}" mass="{link.mass!r}" fullinertia="{_text(full)}"/>'
        )
        closing.append("</body>")
    return (
        '<mujoco><compiler angle="radian"/>'
        f'<option gravity="{_text(chain.gravity)}"><flag contact="disable" constraint="disable"/></option>'
        f"<worldbody>{''.join(bodies)}{''.join(closing)}</worldbody></mujoco>"
    )


class MuJoCo:
    """A chain in MuJoCo."""

    def __init__(self, chain: Chain) -> None:
        self.model = mujoco.MjModel.from_xml_string(mjcf(chain))
        self.model.opt.enableflags |= mujoco.mjtEnableBit.mjENBL_ENERGY
        self.data = mujoco.MjData(self.model)

    def terms(self, q: FloatArray, velocity: FloatArray) -> Terms:
        """Dynamics at one state."""
        data = self.data
        data.qpos[:], data.qvel[:] = q, 0.0
        mujoco.mj_forward(self.model, data)
        gravity = np.array(data.qfrc_bias)
        data.qvel[:] = velocity
        mujoco.mj_forward(self.model, data)
        inertia = np.zeros((self.model.nv, self.model.nv))
        mujoco.mj_fullM(self.model, data, inertia)
        potential, kinetic = data.energy
        return Terms(inertia, np.array(data.qfrc_bias), gravity, float(kinetic), float(potential))


class Pinocchio:
    """A chain in Pinocchio."""

    def __init__(self, chain: Chain) -> None:
        self.model = pinocchio.Model()
        self.model.gravity.linear = chain.gravity
        placement = pinocchio.SE3.Identity()
        parent = 0
        for number, (joint, link) in enumerate(zip(chain.joints, _loaded_links(chain), strict=True), start=1):
            revolute = joint.kind is JointKind.REVOLUTE
            kind: Any = pinocchio.JointModelRZ() if revolute else pinocchio.JointModelPZ()
            parent = self.model.addJoint(parent, kind, placement, f"joint{number}")
            placement = pinocchio.SE3(*_fixed_part(joint))
            body = pinocchio.Inertia(link.mass, link.centre_of_mass, link.inertia)
            self.model.appendBodyToJoint(parent, body, placement)
        self.model.armature = np.array([j.rotor_inertia for j in chain.joints])
        self.data = self.model.createData()

    def terms(self, q: FloatArray, velocity: FloatArray) -> Terms:
        """Dynamics at one state."""
        model, data = self.model, self.data
        inertia = np.array(pinocchio.crba(model, data, q))
        inertia = np.triu(inertia) + np.triu(inertia, 1).T
        bias = np.array(pinocchio.nonLinearEffects(model, data, q, velocity))
        gravity = np.array(pinocchio.computeGeneralizedGravity(model, data, q))
        potential = pinocchio.computePotentialEnergy(model, data, q)
        return Terms(inertia, bias, gravity, float(velocity @ inertia @ velocity) / 2, float(potential))


def _fixed_part(joint: Joint) -> tuple[FloatArray, FloatArray]:
    """Rotation and translation of a joint's D-H transform at variable zero, from elementary turns."""
    ct, st, ca, sa = np.cos(joint.theta), np.sin(joint.theta), np.cos(joint.alpha), np.sin(joint.alpha)
    about_z = np.array([[ct, -st, 0.0], [st, ct, 0.0], [0.0, 0.0, 1.0]])
    about_x = np.array([[1.0, 0.0, 0.0], [0.0, ca, -sa], [0.0, sa, ca]])
    return about_z @ about_x, np.array([0.0, 0.0, joint.d]) + about_z @ [joint.a, 0.0, 0.0]


def _loaded_links(chain: Chain) -> list[Link]:
    """Links with the point load merged into the last, by the two-body formula (reduced mass)."""
    links = list(chain.links)
    last = links[-1]
    total = last.mass + chain.load
    if chain.load > 0:
        apart = chain.load_position - last.centre_of_mass
        reduced = last.mass * chain.load / total
        inertia = last.inertia + reduced * (apart @ apart * np.eye(3) - np.outer(apart, apart))
        links[-1] = Link(total, last.centre_of_mass + chain.load / total * apart, inertia)
    return links


def _text(values: Any) -> str:
    return " ".join(repr(float(v)) for v in values)
