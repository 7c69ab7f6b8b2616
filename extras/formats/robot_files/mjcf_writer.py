"""Writes a model as MJCF, MuJoCo's own format. MuJoCo's writer is not used, because it keeps only six digits."""

from __future__ import annotations

import math
from collections.abc import Sequence
from xml.etree import ElementTree as Xml

import numpy as np

from daq.contracts.errors import SpecError
from extras.formats.robot_files.bodies_of_model import (
    OutgoingArm,
    OutgoingLink,
    effects_left_out,
    left_out,
    motor_numbers,
    outgoing_arm,
)
from extras.formats.robot_files.numbers import text_of
from model import layout as at
from model.arrays import Floats
from model.effects.names import effect_name
from model.machine_model.model import EffectUse, Model

HELD = frozenset(
    (
        *(at.VISCOUS, at.COULOMB, at.SPRING, at.SPRING_REST, at.CONSTANT_TORQUE, at.FLUX_LOSS, at.INDUCTANCE),
        *(at.SUPPLY, at.HEATING, at.COOLING_TIME, at.STRIBECK, at.STRIBECK_SPEED),
        *(at.RIPPLE_SINE, at.RIPPLE_COSINE, at.RIPPLE_CYCLES),
    )
)
"""Numbers of effects that MJCF has a place for, beside those of the bodies."""
OF_MOTORS = frozenset(("motor_inductance", "resistance_drift"))
"""Effects that only MuJoCo's `dcmotor` has."""
NEARLY = {
    "coulomb_friction": "as a constraint that yields a little",
    "stribeck_friction": "as LuGre friction, which falls with exp(-(v/V)^2)",
    "resistance_drift": "heated by the resistance that has risen",
}
"""What differs of an effect that MuJoCo has in another form."""
COPPER = 0.0039
"""Relative rise of a copper winding's resistance, 1/K."""
LEAST_MOMENT = 1e-10
"""Least principal moment of a body, as a share of its largest: MuJoCo rejects the 0 of a thin rod about itself."""
SMALLEST_MOMENT = 1e-14
"""Least principal moment of a body, kg·m²: MuJoCo treats smaller ones as 0."""
LEAST_MASS = 1e-9
"""Least mass (kg) of a body: MuJoCo rejects a massless one that moves."""


def effects_not_in_mjcf(model: Model) -> tuple[EffectUse, ...]:
    """Returns the effects of a model that its MJCF leaves out."""
    return (*effects_left_out(model, HELD), *_of_motors(model, outgoing_arm(model)))


def _of_motors(model: Model, arm: OutgoingArm) -> list[EffectUse]:
    """Effects of motors, where a drive without back-EMF has no motor in MJCF."""
    if all(link.back for link in arm.links):
        return []
    return [use for use in model.effects if use.name in OF_MOTORS]


def mjcf_text(model: Model) -> tuple[str, list[str]]:
    """Returns the model's MJCF, and the parts of the model that it leaves out.

    Every drive is an actuator whose control is the recorded drive: a `dcmotor` with the file's constants where back-EMF
    is known, which MuJoCo has from 3.7 on. Raises SpecError for a link that no real body can be.
    """
    arm = outgoing_arm(model)
    lost = left_out(model, HELD)
    simple = [link.joint for link in arm.links if not link.back]
    lost += [f"{effect_name(use.name)} of {', '.join(simple)}" for use in _of_motors(model, arm)]
    nearly = [f"{effect_name(use.name)} {NEARLY[use.name]}" for use in model.effects if use.name in NEARLY]
    said = f" Made from model {model.identity}. Not in it: {'; '.join(lost) or 'nothing'}. "
    said += f"Nearly: {'; '.join(nearly)}. " if nearly else ""
    root = Xml.Element("mujoco", model=arm.name)
    root.append(Xml.Comment(said.replace("--", "- -")))
    Xml.SubElement(root, "compiler", angle="radian", autolimits="true")
    Xml.SubElement(root, "option", gravity=text_of(0.0, 0.0, -arm.gravity), timestep="0.001", integrator="implicitfast")
    roll, pitch = arm.tilt
    turn = _product(_about("y", pitch), _about("x", roll))
    parent = Xml.SubElement(Xml.SubElement(root, "worldbody"), "body", name="base", quat=text_of(*turn))
    for link, end in zip(arm.links, [*(following.place for following in arm.links[1:]), arm.tool], strict=True):
        parent = _body(parent, link, end)
    Xml.SubElement(parent, "site", name="tool", pos=text_of(*arm.tool[:3, 3]), quat=_turn(arm.tool_angles))
    actuators = Xml.SubElement(root, "actuator")
    for write in (_drive, _passive, _preload):  # so that the drives are the first controls
        for link in arm.links:
            write(actuators, link)
    Xml.indent(root)
    return Xml.tostring(root, "unicode") + "\n", lost


def _body(parent: Xml.Element, link: OutgoingLink, end: Floats) -> Xml.Element:
    body = Xml.SubElement(parent, "body", name=link.name, pos=text_of(*link.place[:3, 3]), quat=_turn(link.angles))
    mass, inertia = _heavy_enough(link)
    xx, yy, zz, xy, xz, yz = (inertia[pair] for pair in ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)))
    Xml.SubElement(
        body, "inertial", pos=text_of(*link.centre), mass=text_of(mass), fullinertia=text_of(xx, yy, zz, xy, xz, yz)
    )
    joint = Xml.SubElement(body, "joint", name=link.joint, type="slide" if link.slides else "hinge", axis="0 0 1")
    if link.low is not None or link.high is not None:
        joint.set(
            "range", text_of(*(1e9 * sign if end is None else end for sign, end in ((-1, link.low), (1, link.high))))
        )
    for name, value in (
        ("armature", link.rotor),
        ("damping", link.viscous),
        ("frictionloss", 0.0 if link.numbers[at.STRIBECK] else link.coulomb),
        ("stiffness", link.stiffness),
        ("springref", link.slack if link.stiffness else 0.0),
    ):
        if value:
            joint.set(name, text_of(value))
    length = float(np.linalg.norm(end[:3, 3]))
    if length > 1e-3:  # only for display; it has no mass and touches nothing
        Xml.SubElement(
            body,
            "geom",
            type="capsule",
            fromto=text_of(0.0, 0.0, 0.0, *end[:3, 3]),
            size=text_of(0.06 * length),
            mass="0",
            contype="0",
            conaffinity="0",
        )
    return body


def _drive(actuators: Xml.Element, link: OutgoingLink) -> None:
    actuator = Xml.SubElement(actuators, "dcmotor" if link.back else "general")
    actuator.set("name", f"{link.joint}_drive")
    actuator.set("joint", link.joint)
    if link.back:
        _motor(actuator, link)
    else:
        actuator.set("gainprm", text_of(link.gain))
    if link.drive_limit is not None:
        actuator.set("ctrlrange", text_of(-link.drive_limit, link.drive_limit))


def _motor(actuator: Xml.Element, link: OutgoingLink) -> None:
    numbers = link.numbers
    for name, value in zip(("gear", "motorconst", "resistance"), motor_numbers(link), strict=True):
        actuator.set(name, text_of(value))
    if link.lags:
        actuator.set("inductance", text_of(0.0, float(numbers[at.INDUCTANCE] / numbers[at.RESISTANCE])))
    if numbers[at.HEATING]:
        # α R' i'² / C is to be h i², with this motor's current i' = K_T/K_b i
        scale = float(numbers[at.TORQUE_CONSTANT] / numbers[at.BACK_EMF])
        capacity = COPPER * float(numbers[at.RESISTANCE]) * scale / float(numbers[at.HEATING])
        actuator.set("thermal", text_of(0.0, capacity, float(numbers[at.COOLING_TIME]), COPPER, 25.0, 25.0))


def _passive(actuators: Xml.Element, link: OutgoingLink) -> None:
    """Ripple and Stribeck friction: MuJoCo has them in a motor without constants or controls."""
    numbers = link.numbers
    ripple, kinetic = math.hypot(numbers[at.RIPPLE_SINE], numbers[at.RIPPLE_COSINE]), float(numbers[at.COULOMB])
    parts = {}
    if ripple:
        phase = math.atan2(numbers[at.RIPPLE_COSINE], numbers[at.RIPPLE_SINE])
        parts["cogging"] = text_of(ripple, float(numbers[at.RIPPLE_CYCLES]), phase)
    if numbers[at.STRIBECK]:
        static = kinetic + float(numbers[at.STRIBECK])
        stiffness = static / float(numbers[at.PRESLIDING])
        parts["lugre"] = text_of(stiffness, 0.0, kinetic, static, float(numbers[at.STRIBECK_SPEED]))
    if parts:
        Xml.SubElement(
            actuators,
            "dcmotor",
            {"name": f"{link.joint}_losses", "joint": link.joint, "input": "none", "motorconst": "0", "resistance": "1"}
            | parts,
        )


def _preload(actuators: Xml.Element, link: OutgoingLink) -> None:
    if torque := float(link.numbers[at.CONSTANT_TORQUE]):
        preload = Xml.SubElement(actuators, "general", name=f"{link.joint}_preload", joint=link.joint)
        for name, value in (("gainprm", text_of(0.0)), ("biastype", "affine"), ("biasprm", text_of(torque))):
            preload.set(name, value)


def _heavy_enough(link: OutgoingLink) -> tuple[float, Floats]:
    """Returns mass and inertia that MuJoCo accepts: a thin rod's are increased by 1e-10 of themselves. Raises
    SpecError."""
    inertia = 0.5 * (link.inertia + link.inertia.T)
    least, middle, most = np.linalg.eigvalsh(inertia)
    floor = max(LEAST_MOMENT * float(most), SMALLEST_MOMENT)
    missing = max(floor - least, floor - (least + middle - most), 0.0)
    if missing > 11.0 * floor or link.mass < 0.0:
        shown = ", ".join(f"{moment:.4g}" for moment in (least, middle, most))
        raise SpecError(
            f"link of joint {link.joint}: {link.mass:.4g} kg with the principal moments {shown} kg·m² is not "
            "physically consistent, as MuJoCo requires; a URDF can be written (daq machine to-urdf)"
        )
    return max(link.mass, LEAST_MASS), inertia + missing * np.eye(3)


def _turn(angles: tuple[float, float, float]) -> str:
    """Returns the quaternion of roll, pitch and yaw, as text."""
    roll, pitch, yaw = angles
    return text_of(*_product(_about("z", yaw), _product(_about("y", pitch), _about("x", roll))))


def _about(axis: str, angle: float) -> tuple[float, ...]:
    vector = [math.sin(0.5 * angle) if letter == axis else 0.0 for letter in "xyz"]
    return (math.cos(0.5 * angle), *vector)


def _product(one: Sequence[float], other: Sequence[float]) -> tuple[float, ...]:
    """Returns the product of two quaternions (w, x, y, z)."""
    a, b = np.array(one[1:]), np.array(other[1:])
    w = one[0] * other[0] - float(a @ b)
    x, y, z = one[0] * b + other[0] * a + np.cross(a, b)
    return (w, float(x), float(y), float(z))
