"""Converts a model's links for URDF and MJCF: each in a frame at its own joint, with its inertia about its centre."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from daq.contracts.machine import NoController
from extras.formats.robot_files.denavit_hartenberg import transform
from model import layout as at
from model.arrays import Floats
from model.drives.magnet import back_emf_constant, torque_constant
from model.effects.library import effect
from model.machine_model.model import Model
from model.simulation.chain_of_model import chain_of

IN_BODIES = frozenset((at.MASS_ADDED, at.PAYLOAD, at.TILT_X, at.TILT_Y, at.SHIFT))
"""Effect parameters that are part of masses, centres and gravity."""


@dataclass(frozen=True, eq=False)
class OutgoingLink:
    """One link with its joint.

    name, joint: names of link and joint, unique in a file
    slides:   whether the joint is prismatic
    place:    (4, 4) frame of the link in that of the previous link, with the joint at 0; the joint's axis is its z
    angles:   roll, pitch and yaw (rad) of `place`: α and θ of the previous link mass, centre (3,), inertia (3, 3) about
    the centre, in the link's frame
    low, high, speed: limits; None for no limit
    rotor:    inertia of the drive at the joint, kg·m² or kg
    gain, back: torque (N·m, N) at the joint per unit of drive, and lost per unit of speed through the drive itself
    viscous, coulomb: friction at the joint
    stiffness, slack: of a spring at the joint, and its slack position
    drive_limit: largest drive; None for no limit
    """

    name: str
    joint: str
    slides: bool
    place: Floats
    angles: tuple[float, float, float]
    mass: float
    centre: Floats
    inertia: Floats
    low: float | None
    high: float | None
    speed: float | None
    rotor: float
    gain: float
    back: float
    viscous: float
    coulomb: float
    stiffness: float
    slack: float
    drive_limit: float | None


@dataclass(frozen=True, eq=False)
class OutgoingArm:
    """An arm to be written, base first.

    tilt: roll and pitch (rad) that turn its base so that gravity points down
    gravity: its magnitude, m/s²
    tool, tool_angles: (4, 4) frame of the end of the last link in that link's, and its roll, pitch and yaw (rad)
    """

    name: str
    links: tuple[OutgoingLink, ...]
    tilt: tuple[float, float]
    gravity: float
    tool: Floats
    tool_angles: tuple[float, float, float]


def outgoing_arm(model: Model) -> OutgoingArm:
    """Returns the arm of a model with its own values: effects in the masses, load and payload included."""
    chain, machine = chain_of(model), model.machine
    numbers = model.vector[at.SHARED :].reshape(model.joint_count, at.PER_JOINT)
    place, angles = np.eye(4), (0.0, 0.0, 0.0)
    links, taken = [], set[str]()
    for i, joint in enumerate(numbers):
        theta, d, a, alpha = (float(value) for value in chain.geometry[i])
        rest = transform(theta, d, a, alpha)  # from the link's D–H frame to one at its joint, before θ
        described, limit = machine.joints[i], machine.limits.joint(i + 1)
        mass, centre, inertia = _about_centre(chain.inertial[i])
        gear, resistance = float(joint[at.GEAR]), float(joint[at.RESISTANCE])
        gain = gear * float(torque_constant(joint)) / resistance
        name = _unlike(described.name or f"joint{i + 1}", taken)
        supply = float(joint[at.SUPPLY])
        links.append(
            OutgoingLink(
                name=f"{name}_link",
                joint=name,
                slides=bool(chain.prismatic[i]),
                place=place,
                angles=angles,
                mass=mass,
                centre=rest[:3, :3] @ centre + rest[:3, 3],
                inertia=rest[:3, :3] @ inertia @ rest[:3, :3].T,
                low=limit.low,
                high=limit.high,
                speed=limit.speed,
                rotor=float(chain.rotor_inertia[i]),
                gain=gain,
                back=gain * float(back_emf_constant(joint)) * gear,
                viscous=float(joint[at.VISCOUS]) * gear**2,
                coulomb=float(joint[at.COULOMB]),
                stiffness=float(joint[at.SPRING]),
                slack=float(joint[at.SPRING_REST]),
                drive_limit=supply if supply < 1e9 else None,
            )
        )
        place, angles = rest, (alpha, 0.0, theta)
    x, y, z = (float(g) for g in chain.gravity)
    down = math.hypot(y, z)
    tilt = (math.atan2(-y, -z) if down > 0.0 else 0.0, math.atan2(x, down) if x != 0.0 else 0.0)
    return OutgoingArm(machine.name, tuple(links), tilt, math.hypot(x, down), place, angles)


def left_out(model: Model, held: frozenset[int]) -> list[str]:
    """Returns the parts of a model that a format cannot hold: effects, sensors, the controller. held: columns that it
    can.
    """
    found = []
    for use in model.effects:
        columns = {parameter.column for parameter in effect(use.name).parameters}
        own_file = use.file is not None
        if own_file or not columns <= held | IN_BODIES:
            joints = f" (joint {', '.join(map(str, use.joints))})" if use.joints else ""
            found.append(f"{use.name}{joints}")
    if any(joint.sensor is not None for joint in model.machine.joints):
        found.append("sensors")
    if not isinstance(model.machine.controller, NoController):
        found.append("controller")
    return found


def _about_centre(inertial: Floats) -> tuple[float, Floats, Floats]:
    """Returns mass, centre of mass and inertia about it, from mass, first moments and inertia about the frame's
    origin.
    """
    mass, moments = float(inertial[0]), inertial[1:4]
    xx, xy, xz, yy, yz, zz = inertial[4:]
    about_origin = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    if mass == 0.0:
        return 0.0, np.zeros(3), about_origin
    centre = moments / mass
    return mass, centre, about_origin - mass * (float(centre @ centre) * np.eye(3) - np.outer(centre, centre))


def _unlike(name: str, taken: set[str]) -> str:
    """Returns the name, or with an appended number a name that no joint has yet."""
    plain = "_".join("".join(sign if sign.isprintable() else " " for sign in name).split()) or "joint"
    found, number = plain, 2
    while found in taken:
        found, number = f"{plain}_{number}", number + 1
    taken.add(found)
    return found
