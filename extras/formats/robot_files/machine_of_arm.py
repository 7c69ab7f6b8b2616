"""Converts an arm of a URDF to a machine. What the URDF lacks comes from another machine, or is a marked assumption."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
from pydantic import ValidationError

from daq.contracts.errors import SpecError
from daq.contracts.limits import JointLimits, Limits
from daq.contracts.machine import (
    Body,
    CurrentDrive,
    DcMotor,
    Friction,
    Geometry,
    Joint,
    Machine,
    NoController,
    PlainGain,
    Sensor,
)
from daq.contracts.quantity import Quantity
from daq.contracts.refused import refused_words
from extras.formats.robot_files.denavit_hartenberg import Frames, Parameters, frames_of
from extras.formats.robot_files.description import DescribedJoint
from extras.formats.robot_files.serial_arm import ArmJoint, SerialArm, serial_arm
from extras.formats.robot_files.urdf_reader import read_urdf
from model.arrays import Floats

EXPECTED_FRICTION = 0.1
"""Expected size of friction that the URDF does not state, as a share of the joint's largest torque: typical of geared
arms, and wide enough for a fit to find another."""


class JointParts(NamedTuple):
    """Data of a joint that a URDF lacks, or states as a placeholder; None if unknown."""

    drive: DcMotor | CurrentDrive | PlainGain | None = None
    friction: Friction | None = None
    sensor: Sensor | None = None


def machine_from_urdf(
    path: Path | str,
    joints: Sequence[str] | None = None,
    *,
    hold: Mapping[str, float] | None = None,
    tip: str | None = None,
    gravity: tuple[float, float, float] | None = None,
    drives: Machine | None = None,
    name: str | None = None,
) -> Machine:
    """Returns the machine that some joints of a URDF form: its kinematics, masses, inertias and limits.

    Drives, friction, sensors and the controller are not in a URDF. They come from the joints of the same names in
    `drives`, or are assumptions: a drive that is a torque (a force), friction as the URDF states it or 0. The machine's
    `notes` list held joints and assumptions.

    Args:
        path: the URDF; its meshes are not read.
        joints: names of the joints that move; None for all, if they form a chain. The others are held.
        hold: positions of held joints, rad or m; 0 by default.
        tip: link whose frame is the end of the arm, where a load is attached; None for the last joint's own link.
        gravity: in the axes of the URDF's root, m/s²; None for the file's (MuJoCo's extension), or 9.81 down.
        drives: a machine whose drives, friction and sensors are used by joint name, and its controller if all its
            joints match.
        name: of the machine; None for that of the robot.

    Raises SpecError with one line.
    """
    arm = serial_arm(read_urdf(Path(path)), joints, hold, tip)
    return machine_of_arm(arm, gravity, drives, {}, name)


def machine_of_arm(
    arm: SerialArm,
    gravity: tuple[float, float, float] | None,
    drives: Machine | None,
    parts: Mapping[str, JointParts],
    name: str | None,
) -> Machine:
    """Returns the machine of an arm; see `machine_from_urdf`. `parts` of a joint take precedence over `drives`."""
    names = [joint.joint.name for joint in arm.joints]
    source = Path(arm.description.origin).name
    try:
        frames = frames_of([j.point for j in arm.joints], [j.direction for j in arm.joints], arm.tip, names)
    except SpecError as error:
        raise SpecError("; ".join([str(error), *arm.description.doubts])) from error
    down = arm.description.gravity if gravity is None else np.array(gravity)
    known = _known(names, drives, parts)
    doubts = [f"CHECK: {doubt}" for doubt in arm.description.doubts]
    notes = [f"Made from {source}.", *doubts, *_held(arm), *(f"{note[0].upper()}{note[1:]}." for note in frames.notes)]
    made = []
    for i, joint in enumerate(arm.joints):
        body = _body(joint, frames, i + 1, source, notes)
        made.append(_joint(joint.joint, frames.parameters[i], body, known[i], _torque(arm, i, down), source))
    notes += _assumed(made, arm)
    title = arm.description.name
    try:
        return Machine(
            version=1,
            name=name or _slug(title),
            title=f"{title} ({source})",
            notes="\n".join(notes),
            gravity=tuple(float(g) + 0.0 for g in frames.axes[0].T @ down),
            joints=tuple(made),
            modelled_joints=tuple(range(1, len(made) + 1)),
            controller=_controller(names, drives),
            limits=Limits(joints=tuple(_limits(joint.joint) for joint in arm.joints)),
        )
    except ValidationError as error:
        raise SpecError(f"{source}: {refused_words(error, Machine, 'machine')}") from error


def _known(names: Sequence[str], drives: Machine | None, parts: Mapping[str, JointParts]) -> list[JointParts]:
    if unknown := [name for name in parts if name not in names]:
        raise SpecError(f"parts of joint {unknown[0]!r}: the arm has {', '.join(names)}")
    of_other = {} if drives is None else {joint.name: joint for joint in drives.joints}
    if drives is not None and not set(names) & set(of_other):
        raise SpecError(f"drives of {drives.name}: none of its joints ({', '.join(of_other)}) is in the arm: {names}")
    found = []
    for name in names:
        own, other = parts.get(name, JointParts()), of_other.get(name)
        found.append(
            own
            if other is None
            else JointParts(own.drive or other.drive, own.friction or other.friction, own.sensor or other.sensor)
        )
    return found


def _controller(names: Sequence[str], drives: Machine | None) -> object:
    """Returns the other machine's controller, if it has the same joints: its gains have a row for each."""
    if drives is not None and [joint.name for joint in drives.joints] == list(names):
        return drives.controller
    return NoController(kind="none")


def _joint(
    joint: DescribedJoint, parameters: Parameters, body: Body, known: JointParts, torque: float, source: str
) -> Joint:
    slides = joint.kind == "prismatic"

    def given(value: float, unit: str) -> Quantity:
        return Quantity(value=value, unit=unit, source=source)

    return Joint(
        name=joint.name,
        kind=joint.kind,
        geometry=Geometry(
            a=given(parameters.a, "m"),
            alpha=given(parameters.alpha, "rad"),
            d=given(parameters.d, "m"),
            theta=given(parameters.theta, "rad"),
        ),
        link=body,
        drive=known.drive or torque_drive(slides),
        friction=known.friction or _friction(joint, torque, source),
        sensor=known.sensor,
    )


def torque_drive(slides: bool) -> PlainGain:
    """Returns the assumption for an unknown drive: the recorded signal is its torque (force)."""
    unit, word = ("N/N", "force") if slides else ("N·m/(N·m)", "torque")
    gain = Quantity(value=1.0, unit=unit, source=f"the recorded drive is the {word} at the joint", assumed=True)
    return PlainGain(kind="gain", gain=gain)


def _friction(joint: DescribedJoint, torque: float, source: str) -> Friction:
    """Returns friction as the URDF states it, or else 0; a fit may find another value."""
    slides = joint.kind == "prismatic"
    speed = joint.speed or 1.0

    def number(stated: float | None, expected: float, unit: str) -> Quantity:
        if stated:
            return Quantity(value=stated, unit=unit, source=source, low=0.0, deviation=stated)
        missing = "not in the URDF" if stated is None else "0 in the URDF"
        return Quantity(value=0.0, unit=unit, source=missing, assumed=True, low=0.0, deviation=expected)

    expected = EXPECTED_FRICTION * torque
    return Friction(
        viscous=number(joint.damping, expected / speed, "N·s/m" if slides else "N·m·s/rad"),
        coulomb=number(joint.friction, expected, "N" if slides else "N·m"),
    )


def _torque(arm: SerialArm, index: int, gravity: Floats) -> float:
    """Returns a joint's largest torque (force): its limit, or what holds the rest of the arm against gravity; else
    1."""
    own = arm.joints[index]
    if own.joint.effort is not None:
        return own.joint.effort
    beyond = [joint.body for joint in arm.joints[index:]]
    arms = [1.0 if own.joint.kind == "prismatic" else float(np.linalg.norm(b.centre - own.point)) for b in beyond]
    pull = float(np.linalg.norm(gravity))
    return pull * sum(body.mass * arm_ for body, arm_ in zip(beyond, arms, strict=True)) or 1.0


def _body(joint: ArmJoint, frames: Frames, number: int, source: str, notes: list[str]) -> Body:
    """Returns the link in the axes of its own frame; adds a note if its moments are physically inconsistent."""
    axes = frames.axes[number]
    centre = axes.T @ (joint.body.centre - frames.origins[number])
    inertia = axes.T @ joint.body.inertia @ axes
    inertia = 0.5 * (inertia + inertia.T)
    moments = np.linalg.eigvalsh(inertia)
    rounding = 1e-9 * max(abs(moments[0]), abs(moments[2]))
    diagonal = np.diagonal(inertia).copy()
    diagonal[np.abs(diagonal) < 1e-12 * np.abs(moments).max()] = 0.0
    where = f"{source}: what joint {joint.joint.name!r} carries"
    if (diagonal < 0.0).any():
        raise SpecError(f"{where} has the negative moment of inertia {diagonal.min():.4g} kg·m²")
    if moments[0] < -rounding or moments[2] > moments[0] + moments[1] + rounding:
        shown = ", ".join(f"{moment:.4g}" for moment in moments)
        notes.append(f"No real body has the moments that joint {joint.joint.name} carries ({shown} kg·m²).")

    def given(value: float, unit: str) -> Quantity:
        return Quantity(value=float(value) + 0.0, unit=unit, source=source)

    xx, yy, zz = (given(moment, "kg·m²") for moment in diagonal)
    xy, xz, yz = (given(inertia[pair], "kg·m²") for pair in ((0, 1), (0, 2), (1, 2)))
    x, y, z = (given(c, "m") for c in centre)
    return Body(shape="body", mass=given(joint.body.mass, "kg"), centre=(x, y, z), inertia=(xx, yy, zz, xy, xz, yz))


def _limits(joint: DescribedJoint) -> JointLimits:
    return JointLimits(low=joint.low, high=joint.high, speed=joint.speed)


def _held(arm: SerialArm) -> list[str]:
    if not arm.held:
        return []
    return [f"Held: {', '.join(f'{name} at {value:g}' for name, value in arm.held.items())}."]


def _assumed(joints: Sequence[Joint], arm: SerialArm) -> list[str]:
    """Returns the machine's assumptions, one per line."""
    lines = []
    for what, names in (
        (
            "the recorded drive is the torque (force) at the joint",
            [j.name for j in joints if isinstance(j.drive, PlainGain) and _is_assumed(j.drive.gain)],
        ),
        ("no drive's inertia is known", [j.name for j in joints if _without_inertia(j.drive)]),
        ("no viscous friction", [j.name for j in joints if _is_assumed(j.friction.viscous)]),
        ("no Coulomb friction", [j.name for j in joints if _is_assumed(j.friction.coulomb)]),
        ("positions are exact (no sensor)", [j.name for j in joints if j.sensor is None]),
    ):
        if names:
            of = "all joints" if len(names) == len(joints) else ", ".join(names)
            lines.append(f"Assumed of {of}: {what}.")
    if unlimited := [j.joint.name for j in arm.joints if j.joint.low is None]:
        lines.append(f"The URDF states no range of {', '.join(unlimited)}.")
    return lines


def _is_assumed(number: Quantity | None) -> bool:
    return number is not None and number.assumed


def _without_inertia(drive: DcMotor | CurrentDrive | PlainGain) -> bool:
    return drive.inertia is None if isinstance(drive, PlainGain) else drive.rotor_inertia is None


def _slug(name: str) -> str:
    return re.sub(r"[^a-z0-9_-]+", "-", name.lower()).strip("-_") or "robot"
