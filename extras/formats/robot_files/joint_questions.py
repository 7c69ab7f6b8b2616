"""Asks a person what is known of an arm's drives and friction."""

from __future__ import annotations

from typing import TYPE_CHECKING

import typer

from daq.contracts.errors import SpecError
from daq.contracts.machine import CurrentDrive, Friction, PlainGain
from daq.contracts.machine_units import RECORDED_IN
from daq.contracts.quantity import Quantity
from daq_cli.app.context import console
from daq_cli.app.quantities import parse_numbers

if TYPE_CHECKING:
    from collections.abc import Sequence

    from extras.formats.robot_files.machine_of_arm import JointParts
    from extras.formats.robot_files.serial_arm import ArmJoint

SOURCE = "as told when the file was made"
KINDS = ("torque", "current", "other")


def asked_parts(joints: Sequence[ArmJoint]) -> dict[str, JointParts]:
    """What a person says of every joint; Enter means that it is not known."""
    console().print("Enter leaves a number unknown; the file then marks an assumption.")
    return {joint.joint.name: _parts(joint.joint.name, joint.joint.kind == "prismatic") for joint in joints}


def _parts(name: str, slides: bool) -> JointParts:
    from extras.formats.robot_files.machine_of_arm import JointParts

    torque, inertia, speed = ("N", "kg", "m/s") if slides else ("N·m", "kg·m²", "rad/s")
    viscous = _asked(f"{name}: viscous friction at the joint", f"{torque} per {speed}")
    coulomb = _asked(f"{name}: Coulomb friction at the joint", torque)
    friction = None
    if viscous is not None or coulomb is not None:
        friction = Friction(
            viscous=None if viscous is None else _known(viscous, "N·s/m" if slides else "N·m·s/rad"),
            coulomb=None if coulomb is None else _known(coulomb, torque),
        )
    return JointParts(drive=_drive(name, torque, inertia), friction=friction)


def _drive(name: str, torque: str, inertia: str) -> PlainGain | CurrentDrive | None:
    kind = _choice(f"{name}: what is recorded of its drive ({'/'.join(KINDS)})")
    if kind is None:
        return None
    if kind == "current":
        constant = _asked(f"{name}: torque of the motor for an ampere", "N·m/A", above=0.0)
        gear = _asked(f"{name}: turns of the motor for one of the joint (rad/m where it slides)", "1")
        rotor = _asked(f"{name}: inertia of the rotor, on its own side of the gear", "kg·m²")
        if constant is None or gear is None:
            return None
        own = None if rotor is None else _number(rotor, "kg·m²")
        return CurrentDrive(
            kind="current", torque_constant=_number(constant, "N·m/A"), gear_ratio=_number(gear, "1"), rotor_inertia=own
        )
    gain: float | None = 1.0
    unit = torque
    if kind == "other":
        unit = _recorded_unit(f"{name}: unit of the recorded drive")
        gain = _asked(f"{name}: torque or force at the joint for one {unit}", f"{torque}/{unit}")
    moving = _asked(f"{name}: inertia of the drive, at the joint", inertia)
    if gain is None:
        return None
    own = None if moving is None else _number(moving, "kg·m²")
    return PlainGain(
        kind="gain", gain=_number(gain, f"{torque}/({unit})" if "·" in unit else f"{torque}/{unit}"), inertia=own
    )


def _choice(question: str) -> str | None:
    while True:
        answer = str(typer.prompt(question, default="", show_default=False, err=True)).strip()
        if not answer or answer in KINDS:
            return answer or None
        console().print(f"{answer!r}: answer {', '.join(KINDS)}, or Enter")


def _recorded_unit(question: str) -> str:
    while True:
        answer = str(typer.prompt(question, default="V", err=True)).strip()
        if answer in RECORDED_IN:
            return answer
        console().print(f"{answer!r}: answer {', '.join(RECORDED_IN)}, or Enter for V")


def _asked(question: str, unit: str, above: float | None = None) -> float | None:
    """A number from 0, asked for until one is given; None when it is not known."""
    while True:
        answer = str(typer.prompt(f"{question}, {unit}", default="", show_default=False, err=True)).strip()
        if not answer:
            return None
        try:
            value = parse_numbers(answer, unit, 1)[0]
        except SpecError as error:
            console().print(str(error))
            continue
        if value >= 0.0 and (above is None or value > above):
            return value
        console().print(f"{answer}: {'above 0' if above is not None else '0 or more'} is needed, or Enter")


def _number(value: float, unit: str) -> Quantity:
    return Quantity(value=value, unit=unit, source=SOURCE)


def _known(value: float, unit: str) -> Quantity:
    """Friction, which changes: a fit may move it by as much as itself."""
    return Quantity(value=value, unit=unit, source=SOURCE, low=0.0, deviation=value or 1.0)
