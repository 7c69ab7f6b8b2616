"""Standard parameters of an arm, and the regressor: the columns by which its joint torques depend on them, linearly.

τ = W(q, q̇, q̈) χ (Khalil and Dombre 2002, Modeling, Identification and Control of Robots, chapter 12). A link has ten
inertial parameters. Here they are about the foot of the common normal on its own joint's axis, the frame in which the
textbook groups them: z along the axis, x along the common normal to the next axis. A joint has its rotor's inertia,
friction and a DC motor's damping by its back-EMF.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from daq.contracts.machine import DcMotor
from model import layout as at
from model.arrays import Floats
from model.dynamics.recursive import inverse_dynamics_along
from model.kinematics.chain import ChainArrays
from model.machine_model.model import Model
from model.simulation.chain_of_model import chain_of

OF_LINK = ("m", "MX", "MY", "MZ", "XX", "XY", "XZ", "YY", "YZ", "ZZ")
"""Mass, first moments and moments of inertia of a link, in the order of `ChainArrays.inertial`."""
OF_JOINT = ("Ia", "Fv", "Ke", "Fc")
"""Rotor's inertia, viscous friction, damping by back-EMF and Coulomb friction, all at the joint."""
WORDS = {
    "m": "mass of a link",
    "MX": "mass times x of its centre (MY, MZ alike), from the foot of the common normal on the link's own joint axis; "
    "z along that axis, x along the common normal",
    "XX": "moment of inertia about x at the same point (XY, XZ, YY, YZ, ZZ alike)",
    "Ia": "inertia of the joint's rotor, times the gear ratio squared",
    "Fv": "viscous friction",
    "Ke": "damping by the motor's back-EMF: gear ratio² · torque constant · back-EMF constant / resistance",
    "Fc": "Coulomb friction",
    "a": "Denavit and Hartenberg's length from the joint's axis to the next (d: along the axis)",
}
"""Meanings of the symbols."""
_DEGREE = dict(zip(OF_LINK, (0, 1, 1, 1, 2, 2, 2, 2, 2, 2), strict=True))
_MASS_UNITS = ("kg", "kg·m", "kg·m²")


@dataclass(frozen=True)
class Standard:
    """A standard parameter: its kind (of `OF_LINK` or `OF_JOINT`), the joint (from 1) and the unit.

    `degree` is the power of length in the unit of an inertial parameter; None for friction.
    """

    kind: str
    joint: int
    unit: str
    degree: int | None

    @property
    def symbol(self) -> str:
        """Symbol such as `ZZ_1`."""
        return f"{self.kind}_{self.joint}"


@dataclass(frozen=True)
class Motion:
    """Samples of a motion, each (k, n), SI. contact: direction of motion for friction, in [−1, 1]."""

    position: Floats
    speed: Floats
    acceleration: Floats
    contact: Floats


def link_parameters(joints: int) -> tuple[Standard, ...]:
    """Returns the ten inertial parameters of every link, base first."""
    return tuple(
        Standard(kind, joint, _MASS_UNITS[_DEGREE[kind]], _DEGREE[kind])
        for joint in range(1, joints + 1)
        for kind in OF_LINK
    )


def joint_parameters(model: Model) -> tuple[Standard, ...]:
    """Returns parameters of the joints of a model: a rotor's inertia only if stated, back-EMF only for DC motors."""
    found, rotors = [], chain_of(model).rotor_inertia
    for number, joint in enumerate(model.machine.modelled_joints, start=1):
        own = model.machine.joint(joint)
        turns = own.kind == "revolute"
        damping = "N·m·s/rad" if turns else "N·s/m"
        if rotors[number - 1] != 0.0:
            found.append(Standard("Ia", number, "kg·m²" if turns else "kg", 2 if turns else 0))
        found.append(Standard("Fv", number, damping, None))
        if isinstance(own.drive, DcMotor):
            found.append(Standard("Ke", number, damping, None))
        found.append(Standard("Fc", number, "N·m" if turns else "N", None))
    return tuple(found)


def inertial_regressor(chain: ChainArrays, motion: Motion) -> Floats:
    """Returns columns (k, n, 10 n) of joint torques by the links' inertial parameters, in the order of
    `link_parameters`."""
    joints = chain.geometry.shape[0]
    columns = np.empty((*motion.position.shape, 10 * joints))
    rest = np.zeros(joints)
    position, speed, acceleration = (
        np.ascontiguousarray(one) for one in (motion.position, motion.speed, motion.acceleration)
    )
    for link in range(joints):
        moved = to_link_frame(chain, link)
        distal = np.empty((*position.shape, 10))
        for entry in range(10):
            inertial = np.zeros((joints, 10))
            inertial[link, entry] = 1.0
            part = chain._replace(inertial=inertial, rotor_inertia=rest)
            distal[:, :, entry] = inverse_dynamics_along(part, position, speed, acceleration)
        columns[:, :, 10 * link : 10 * (link + 1)] = distal @ moved
    return columns


def to_link_frame(chain: ChainArrays, link: int) -> Floats:
    """Returns (10, 10) from inertial parameters about the joint's own axis to those about the origin of the link's
    frame."""
    return np.stack([_moved(chain, link, unit, to_axis=False) for unit in np.eye(10)], axis=1)


def about_own_axis(chain: ChainArrays, link: int) -> Floats:
    """Returns the inertial parameters (10,) of a link about the foot of the common normal on its own joint's axis."""
    return _moved(chain, link, chain.inertial[link], to_axis=True)


def _moved(chain: ChainArrays, link: int, body: Floats, *, to_axis: bool) -> Floats:
    """Transforms a body's ten parameters between its two frames, which differ by a along x and α about x.

    It uses the 4 × 4 pseudo-inertia (Wensing, Kim and Slotine 2018).
    """
    length, twist = chain.geometry[link, 2:]
    frame = np.eye(4)  # the link's frame in the one at its axis
    frame[1:3, 1:3] = [[np.cos(twist), -np.sin(twist)], [np.sin(twist), np.cos(twist)]]
    frame[0, 3] = length
    place = frame if to_axis else np.linalg.inv(frame)
    xx, xy, xz, yy, yz, zz = body[4:]
    tensor = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    pseudo = np.empty((4, 4))
    pseudo[:3, :3] = 0.5 * np.trace(tensor) * np.eye(3) - tensor
    pseudo[:3, 3] = pseudo[3, :3] = body[1:4]
    pseudo[3, 3] = body[0]
    pseudo = place @ pseudo @ place.T
    tensor = np.trace(pseudo[:3, :3]) * np.eye(3) - pseudo[:3, :3]
    return np.concatenate(([pseudo[3, 3]], pseudo[:3, 3], tensor[np.triu_indices(3)]))


def joint_regressor(parameters: Sequence[Standard], motion: Motion) -> Floats:
    """Returns columns (k, n, p) of joint torques by parameters of the joints."""
    columns = np.zeros((*motion.position.shape, len(parameters)))
    along = {"Ia": motion.acceleration, "Fv": motion.speed, "Ke": motion.speed, "Fc": motion.contact}
    for place, one in enumerate(parameters):
        columns[:, one.joint - 1, place] = along[one.kind][:, one.joint - 1]
    return columns


def standard_values(model: Model, parameters: Sequence[Standard]) -> Floats:
    """Returns values (p,) of a model's standard parameters; load and payload belong to the last link."""
    chain = chain_of(model)
    joints = model.vector[at.SHARED :].reshape(model.joint_count, at.PER_JOINT)
    links = [about_own_axis(chain, link) for link in range(model.joint_count)]
    values = []
    for one in parameters:
        joint = joints[one.joint - 1]
        flux = 1.0 - joint[at.FLUX_LOSS]
        back_emf = joint[at.TORQUE_CONSTANT] * joint[at.BACK_EMF] * flux**2 / joint[at.RESISTANCE]
        of_joint = {
            "Ia": chain.rotor_inertia[one.joint - 1],
            "Fv": joint[at.GEAR] ** 2 * joint[at.VISCOUS],
            "Ke": joint[at.GEAR] ** 2 * back_emf,
            "Fc": joint[at.COULOMB],
        }
        own = of_joint if one.kind in OF_JOINT else dict(zip(OF_LINK, links[one.joint - 1], strict=True))
        values.append(float(own[one.kind]))
    return np.array(values)
