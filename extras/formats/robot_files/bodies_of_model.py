"""A model's links as URDF and MJCF want them: each in a frame at its own joint, with its inertia about its centre.

It reads the numbers of a model, and no code of its simulation: what MuJoCo makes of them is a second opinion.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from daq.contracts.machine import NoController
from extras.formats.robot_files.denavit_hartenberg import transform
from model import layout as at
from model.arrays import Floats
from model.effects.library import effect
from model.effects.names import effect_on
from model.machine_model.model import EffectUse, Model
from model.machine_model.nominal import NO_LIMIT

IN_BODIES = frozenset((at.MASS_ADDED, at.PAYLOAD, at.TILT_X, at.TILT_Y, at.SHIFT))
"""Effect parameters that are part of masses, centres and gravity."""


@dataclass(frozen=True, eq=False)
class OutgoingLink:
    """One link with its joint.

    name, joint: names of link and joint, unique in a file
    slides:   whether the joint is prismatic
    place:    (4, 4) frame of the link in that of the previous link, with the joint at 0; the joint's axis is its z
    angles:   roll, pitch and yaw (rad) of `place`: α and θ of the previous link
    mass, centre (3,), inertia (3, 3) about the centre, in the link's frame
    low, high, speed: limits; None for no limit
    rotor:    inertia of the drive at the joint, kg·m² or kg
    gain, back: torque (N·m, N) at the joint per unit of drive, and lost per unit of speed through the drive itself
    viscous, coulomb: friction at the joint
    stiffness, slack: of a spring at the joint, and where it is slack
    drive_limit: largest drive; None where there is none
    numbers:  (layout.PER_JOINT,) every number of the joint
    lags:     whether the winding's inductance is part of the model
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
    numbers: Floats
    lags: bool


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
    """The arm that a model describes, with its own numbers: effects in the masses, load and payload included."""
    machine, shared = model.machine, model.vector[: at.SHARED]
    numbers = model.vector[at.SHARED :].reshape(model.joint_count, at.PER_JOINT)
    place, angles = np.eye(4), (0.0, 0.0, 0.0)
    links, taken = [], set[str]()
    for i, joint in enumerate(numbers):
        theta, d, a, alpha = (float(joint[column]) for column in (at.THETA, at.D, at.A, at.ALPHA))
        rest = transform(theta, d, a, alpha)  # from the link's D–H frame to one at its joint, before θ
        described, limit = machine.joints[i], machine.limits.joint(i + 1)
        mass, centre, inertia = _body(joint)
        if i == model.joint_count - 1:
            mass, centre, inertia = _with_load(mass, centre, inertia, float(shared[at.LOAD] + shared[at.PAYLOAD]))
        gear, resistance, flux = float(joint[at.GEAR]), float(joint[at.RESISTANCE]), 1.0 - float(joint[at.FLUX_LOSS])
        gain = gear * flux * float(joint[at.TORQUE_CONSTANT]) / resistance
        name = _unlike(described.name or f"joint{i + 1}", taken)
        supply = float(joint[at.SUPPLY])
        links.append(
            OutgoingLink(
                name=f"{name}_link",
                joint=name,
                slides=bool(joint[at.PRISMATIC]),
                place=place,
                angles=angles,
                mass=mass,
                centre=rest[:3, :3] @ centre + rest[:3, 3],
                inertia=rest[:3, :3] @ inertia @ rest[:3, :3].T,
                low=limit.low,
                high=limit.high,
                speed=limit.speed,
                rotor=float(joint[at.ROTOR_INERTIA]) * gear**2,
                gain=gain,
                back=gain * flux * float(joint[at.BACK_EMF]) * gear,
                viscous=float(joint[at.VISCOUS]) * gear**2,
                coulomb=float(joint[at.COULOMB]),
                stiffness=float(joint[at.SPRING]),
                slack=float(joint[at.SPRING_REST]),
                drive_limit=supply if supply < NO_LIMIT else None,
                numbers=joint,
                lags=bool(model.flags[i] & at.HAS_INDUCTANCE),
            )
        )
        place, angles = rest, (alpha, 0.0, theta)
    x, y, z = _gravity(shared)
    down = math.hypot(y, z)
    tilt = (math.atan2(-y, -z) if down > 0.0 else 0.0, math.atan2(x, down) if x != 0.0 else 0.0)
    return OutgoingArm(machine.name, tuple(links), tilt, math.hypot(x, down), place, angles)


def motor_numbers(link: OutgoingLink) -> tuple[float, float, float]:
    """Gear, one constant for torque and back-EMF (V·s/rad), and the resistance (Ω) with which a voltage gives the
    torque of the file, where that has two constants. Currents are K_T/K_b times the real ones."""
    numbers = link.numbers
    constant = float(numbers[at.BACK_EMF] * (1.0 - numbers[at.FLUX_LOSS]))
    resistance = float(numbers[at.RESISTANCE] * numbers[at.BACK_EMF] / numbers[at.TORQUE_CONSTANT])
    return float(numbers[at.GEAR]), constant, resistance


def effects_left_out(model: Model, held: frozenset[int]) -> list[EffectUse]:
    """Returns the effects of a model that a format cannot hold. held: columns that it can."""
    return [
        use
        for use in model.effects
        if use.file is not None or not {p.column for p in effect(use.name).parameters} <= held | IN_BODIES
    ]


def left_out(model: Model, held: frozenset[int], controller: Sequence[str] = ("controller",)) -> list[str]:
    """Returns the parts of a model that a format cannot hold, in words: effects, sensors, controller.

    held:       columns that the format can hold
    controller: what it lacks of the controller, if the machine has one
    """
    found = [effect_on(use.name, use.joints) for use in effects_left_out(model, held)]
    if any(joint.sensor is not None for joint in model.machine.joints):
        found.append("sensors")
    return found if isinstance(model.machine.controller, NoController) else [*found, *controller]


def _body(joint: Floats) -> tuple[float, Floats, Floats]:
    """Mass, centre of mass (3,) and inertia (3, 3) about it, in the link's Denavit–Hartenberg frame."""
    mass = float(joint[at.MASS] + joint[at.MASS_ADDED])
    along, a, alpha = float(joint[at.SHIFT]), float(joint[at.A]), float(joint[at.ALPHA])
    if joint[at.SHAPE] == at.CYLINDER:  # about the joint's axis, which this frame has turned by α; half of it across
        axis = np.array([0.0, math.sin(alpha), math.cos(alpha)])
        moment = 0.5 * mass * float(joint[at.RADIUS]) ** 2
        return mass, np.array([along - a, 0.0, 0.0]), 0.5 * moment * (np.eye(3) + np.outer(axis, axis))
    if joint[at.SHAPE] == at.ROD:
        return mass, np.array([along - 0.5 * a, 0.0, 0.0]), np.diag([0.0, 1.0, 1.0]) * (mass * a**2 / 12.0)
    xx, yy, zz, xy, xz, yz = (float(moment) for moment in joint[at.INERTIA_XX : at.INERTIA_YZ + 1])
    heavier = mass / float(joint[at.MASS]) if joint[at.MASS] > 0.0 else 1.0  # of the same shape
    centre = joint[at.CENTRE_X : at.CENTRE_Z + 1] + np.array([along, 0.0, 0.0])
    return mass, centre, heavier * np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])


def _with_load(mass: float, centre: Floats, inertia: Floats, load: float) -> tuple[float, Floats, Floats]:
    """The body with a point at the origin of its frame."""
    whole = mass + load
    if whole == 0.0:
        return 0.0, centre, inertia
    about = mass * load / whole * (float(centre @ centre) * np.eye(3) - np.outer(centre, centre))
    return whole, mass / whole * centre, inertia + about


def _gravity(shared: Floats) -> tuple[float, float, float]:
    """Gravity in the axes of a base that is turned about its x axis, then about its y axis."""
    x, y, z = (float(component) for component in shared[at.GRAVITY_X : at.GRAVITY_Z + 1])
    about_x, about_y = float(shared[at.TILT_X]), float(shared[at.TILT_Y])
    y, z = math.cos(about_x) * y + math.sin(about_x) * z, math.cos(about_x) * z - math.sin(about_x) * y
    return math.cos(about_y) * x - math.sin(about_y) * z, y, math.cos(about_y) * z + math.sin(about_y) * x


def _unlike(name: str, taken: set[str]) -> str:
    """Returns the name, or with an appended number a name that no joint has yet."""
    plain = "_".join("".join(sign if sign.isprintable() else " " for sign in name).split()) or "joint"
    found, number = plain, 2
    while found in taken:
        found, number = f"{plain}_{number}", number + 1
    taken.add(found)
    return found
