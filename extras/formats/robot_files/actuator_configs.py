"""A model's drives as actuators of mjlab, of Isaac Lab and of BAM, each with what of the model it cannot express.

Field names are those of mjlab 1.6 (`mjlab.actuator`), Isaac Lab 2.2 (`isaaclab.actuators`) and BAM 1.0 (its JSON).
Torques and speeds are those at the joint.
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

from daq.contracts.errors import SpecError
from daq.contracts.machine import BoardPid, NoController, SampledPid
from extras.formats.robot_files.bodies_of_model import OutgoingLink, left_out, motor_numbers, outgoing_arm
from model import layout as at
from model.machine_model.model import Model
from model.machine_model.nominal import NO_LIMIT

Form = Literal["mjlab", "isaaclab", "bam"]
ALWAYS = (at.VISCOUS, at.COULOMB, at.FLUX_LOSS, at.SUPPLY)
HELD: Mapping[Form, frozenset[int]] = {
    "mjlab": frozenset(
        (*ALWAYS, at.INDUCTANCE, at.STRIBECK, at.STRIBECK_SPEED, at.RIPPLE_SINE, at.RIPPLE_COSINE, at.RIPPLE_CYCLES)
    ),
    "isaaclab": frozenset((*ALWAYS, at.STRIBECK, at.STRIBECK_SPEED)),
    "bam": frozenset((*ALWAYS, at.STRIBECK, at.STRIBECK_SPEED)),
}
"""Numbers of effects that each has a place for. Those of bodies go out as MJCF or URDF."""


@dataclass(frozen=True)
class Servo:
    """A position loop: torque (N·m, N) for an error of 1 rad (m), and for 1 rad/s of its rate."""

    stiffness: float
    damping: float


def actuator_text(
    model: Model, form: Form, joint: int | None = None, actuator: str | None = None
) -> tuple[str, list[str]]:
    """Python text (mjlab, Isaac Lab) or JSON (BAM) with the model's numbers, and what of the model it leaves out.

    Args:
        joint: of BAM, whose file has one actuator. actuator: BAM's name of it, such as `sts3215`.

    Raises SpecError where BAM lacks one of these, or a voltage with back-EMF to describe.
    """
    links = outgoing_arm(model).links
    lost = left_out(model, HELD[form], _of_controller(model.machine.controller))
    if form == "bam":
        return _bam(links, joint, actuator), [
            *lost,
            *([] if isinstance(model.machine.controller, NoController) else ["gains"]),
        ]
    servos = [_servo(model, k, link) for k, link in enumerate(links)]
    write = _mjlab if form == "mjlab" else _isaac
    if form == "isaaclab" and any(link.numbers[at.STRIBECK] for link in links):
        lost.append("the speed over which Stribeck friction falls")
    entries = [write(link, servo) for link, servo in zip(links, servos, strict=True)]
    names = sorted({name for text in entries for name in _CLASSES[form] if name in text})
    package = "mjlab.actuator" if form == "mjlab" else "isaaclab.actuators"
    opening, closing = ("(", ")") if form == "mjlab" else ("{", "}")
    said = f"# Made from model {model.identity}. Not in it: {'; '.join(lost) or 'nothing'}."
    body = "\n".join(entries)
    return f"{said}\nfrom {package} import {', '.join(names)}\n\nACTUATORS = {opening}\n{body}\n{closing}\n", lost


_CLASSES: Mapping[Form, tuple[str, ...]] = {
    "mjlab": (
        "BuiltinDcMotorActuatorCfg",
        "BuiltinMotorActuatorCfg",
        "BuiltinPositionActuatorCfg",
        "DcMotorInputMode",
        "DcMotorPhysicalParams",
    ),
    "isaaclab": ("DCMotorCfg", "ImplicitActuatorCfg"),
}


def _of_controller(controller: BoardPid | SampledPid | NoController) -> list[str]:
    """What a proportional-derivative loop in continuous time lacks of this controller."""
    lost = ["the controller's sampling and delay"]
    integrates = not isinstance(controller, NoController) and any(integral for _, integral, _ in controller.gains)
    lost += ["the controller's integral"] if integrates else []
    if isinstance(controller, SampledPid):
        stated = {
            "inner loop on speed": controller.velocity_gains,
            "dead band": controller.dead_band,
            "steps of its output": controller.drive_resolution,
        }
        lost += [f"the controller's {words}" for words, value in stated.items() if value is not None]
    return lost


def _servo(model: Model, k: int, link: OutgoingLink) -> Servo | None:
    """The position loop of joint k (from 0); None where the machine file states none, or a cascade."""
    controller, numbers = model.machine.controller, link.numbers
    if isinstance(controller, NoController) or getattr(controller, "velocity_gains", None) is not None:
        return None
    proportional, _, derivative = controller.gains[k]
    scale = abs(link.gain) * (1.0 + float(numbers[at.GAIN_ERROR]))
    if isinstance(controller, BoardPid):  # counts of its output for counts of its error
        scale *= abs(float(numbers[at.VOLTS_PER_COUNT] / numbers[at.RAD_PER_COUNT]))
        scale *= controller.dac_counts_per_adc_count.value
        derivative *= controller.period.value
    return Servo(scale * proportional, scale * derivative)


def _limit(link: OutgoingLink) -> float | None:
    """Largest drive: of the supply or of the controller's output."""
    limits = [limit for limit in (link.drive_limit, float(link.numbers[at.OUTPUT_LIMIT])) if limit is not None]
    return min(limits) if min(limits) < NO_LIMIT else None


def _common(link: OutgoingLink) -> dict[str, object]:
    return {"armature": link.rotor, "frictionloss": link.coulomb, "viscous_damping": link.viscous}


def _mjlab(link: OutgoingLink, servo: Servo | None) -> str:
    limit, numbers = _limit(link), link.numbers
    fields: dict[str, object] = {"target_names_expr": (link.joint,), **_common(link)}
    if not link.back:
        effort = None if limit is None else limit * abs(link.gain)
        if servo is None:
            return _entry("BuiltinMotorActuatorCfg", {**fields, "effort_limit": effort or NO_LIMIT})
        loop = {"stiffness": servo.stiffness, "damping": servo.damping}
        return _entry("BuiltinPositionActuatorCfg", {**fields, **loop, "effort_limit": effort})
    gear, constant, resistance = motor_numbers(link)
    fields["motor_params"] = _Text(
        f"DcMotorPhysicalParams(kt={constant!r}, ke={constant!r}, resistance={resistance!r})"
    )
    fields["gear"] = gear
    fields["mode"] = _Text("DcMotorInputMode.VOLTAGE" if servo is None else "DcMotorInputMode.POSITION")
    if servo is not None:  # its loop makes up for back-EMF, and a servo's does not
        fields |= {"stiffness": servo.stiffness / gear**2, "damping": (servo.damping + link.back) / gear**2}
    if limit is not None or servo is not None:
        fields["voltage_limit"] = NO_LIMIT if limit is None else limit
    if link.lags:
        fields["electrical_time_constant"] = float(numbers[at.INDUCTANCE] / numbers[at.RESISTANCE])
    if ripple := math.hypot(numbers[at.RIPPLE_SINE], numbers[at.RIPPLE_COSINE]):
        phase = math.atan2(numbers[at.RIPPLE_COSINE], numbers[at.RIPPLE_SINE])
        fields["cogging"] = (
            ripple / abs(gear),
            float(numbers[at.RIPPLE_CYCLES]) / gear,
            phase * math.copysign(1, gear),
        )
    if numbers[at.STRIBECK]:
        static = link.coulomb + float(numbers[at.STRIBECK])
        stiffness = static / float(numbers[at.PRESLIDING]) / gear**2
        speed = float(numbers[at.STRIBECK_SPEED]) * abs(gear)
        fields |= {"frictionloss": 0.0}
        fields["lugre"] = (stiffness, 0.0, link.coulomb / abs(gear), static / abs(gear), speed)
    return _entry("BuiltinDcMotorActuatorCfg", fields)


def _isaac(link: OutgoingLink, servo: Servo | None) -> str:
    limit, loop = _limit(link), servo or Servo(0.0, 0.0)
    effort = None if limit is None else limit * abs(link.gain)
    fields: dict[str, object] = {
        "joint_names_expr": [link.joint],
        "stiffness": loop.stiffness,
        "damping": loop.damping + link.back,
        "armature": link.rotor,
        "friction": link.coulomb + float(link.numbers[at.STRIBECK]),
        "dynamic_friction": link.coulomb,
        "viscous_friction": link.viscous,
    }
    if not link.back or effort is None:
        return _entry("ImplicitActuatorCfg", {**fields, "effort_limit_sim": effort}, link.joint)
    motor = {"saturation_effort": effort, "effort_limit": effort, "velocity_limit": effort / link.back}
    return _entry("DCMotorCfg", {**fields, **motor}, link.joint)


def _bam(links: tuple[OutgoingLink, ...], joint: int | None, actuator: str | None) -> str:
    if joint is None and len(links) == 1:
        joint = 1
    if joint is None or not 1 <= joint <= len(links):
        raise SpecError(f"BAM's file has one actuator: give --joint and one of 1 to {len(links)}")
    if actuator is None:
        raise SpecError("BAM's file names its actuator: give --actuator and its name there, such as mx106 or sts3215")
    link = links[joint - 1]
    if not link.back or link.slides:
        raise SpecError(
            f"joint {joint}: BAM describes a motor that turns, by voltage and back-EMF; this drive is another"
        )
    gear, constant, resistance = motor_numbers(link)
    falls = float(link.numbers[at.STRIBECK])
    stribeck = {"friction_stribeck": falls, "dtheta_stribeck": float(link.numbers[at.STRIBECK_SPEED]), "alpha": 1.0}
    numbers = {
        "kt": abs(gear) * constant,
        "R": resistance,
        "armature": link.rotor,
        "q_offset": 0.0,
        "friction_base": link.coulomb,
        "friction_viscous": link.viscous,
        **(stribeck if falls else {}),
        "model": "m2" if falls else "m1",
        "actuator": actuator,
    }
    return json.dumps(numbers, indent=4) + "\n"


class _Text(str):
    """Python text that stands as it is."""

    def __repr__(self) -> str:
        return str(self)


def _entry(kind: str, fields: Mapping[str, object], key: str | None = None) -> str:
    """One actuator as Python text; a number that is not known is left out."""
    inner = "".join(f"        {name}={value!r},\n" for name, value in fields.items() if value is not None)
    return f"    {'' if key is None else repr(key) + ': '}{kind}(\n{inner}    ),"
