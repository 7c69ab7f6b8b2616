"""A machine as data: a serial chain of one to six joints with drives, sensors, a controller and limits.

Every number carries its unit and its source, and says where it is an assumption. The file that ships is
`machines/ma2000.toml`; another rig is another file.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from functools import cache
from importlib import resources
from pathlib import Path
from typing import Annotated, Literal, Self

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, ValidationError, model_validator

from daq.contracts.documents import parse_toml, read_text
from daq.contracts.errors import SpecError
from daq.contracts.limits import Limits
from daq.contracts.quantity import (
    Inertia,
    JointValue,
    Kilogram,
    Metre,
    Plain,
    Quantity,
    Radian,
    Second,
    Volt,
    in_unit,
)
from firmware_protocol.invalid import first_invalid
from firmware_protocol.units import DriveScale, JointCalibration

Unitful = Annotated[Quantity, Field()]


def _positive(quantity: Quantity) -> Quantity:
    if not quantity.value > 0.0:
        raise ValueError(f"value {quantity.value} {quantity.unit} must be above 0")
    return quantity


Size = Annotated[Quantity, AfterValidator(_positive)]
Sizes = Size | tuple[Size, ...]
"""A number for all joints, or one a joint."""


class _Part(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)


class Geometry(_Part):
    """Standard Denavit–Hartenberg parameters (section 3.2 of the source): a, α, d, and the offset of θ (or d)."""

    a: Metre
    alpha: Radian
    d: Metre
    theta: Radian


class Cylinder(_Part):
    """A link turning about its own axis: I = ½ m r² about the joint (appendix B)."""

    shape: Literal["cylinder"]
    mass: Kilogram
    radius: Metre


class Rod(_Part):
    """A thin uniform rod along the link's a: centre at a/2, I = m a²/12 about it (appendix B)."""

    shape: Literal["rod"]
    mass: Kilogram


class Body(_Part):
    """A rigid body: centre of mass in the link's own frame (m), inertia about it: xx, yy, zz, xy, xz, yz."""

    shape: Literal["body"]
    mass: Kilogram
    centre: tuple[Metre, Metre, Metre]
    inertia: tuple[Inertia, Inertia, Inertia, Quantity, Quantity, Quantity]


class DcMotor(_Part):
    """Permanent-magnet DC motor behind a linear amplifier and a gear (section 7.1 of the source).

    `gear_ratio` is motor turns per joint turn. `dac_full_scale` is the controller's output at 127 counts.
    """

    kind: Literal["dc_motor"]
    resistance: Annotated[Quantity, in_unit("Ω", above=0.0)]
    inductance: Annotated[Quantity, in_unit("H", at_least=0.0)]
    torque_constant: Annotated[Quantity, in_unit("N·m/A", above=0.0)]
    back_emf_constant: Annotated[Quantity, in_unit("V·s/rad", at_least=0.0)]
    rotor_inertia: Inertia
    gear_ratio: Plain
    amplifier_gain: Plain
    dac_full_scale: Volt
    supply_limit: Volt | None = None

    @property
    def scale(self) -> DriveScale:
        """DAC counts ↔ volts at the motor."""
        return DriveScale(self.dac_full_scale.value, self.amplifier_gain.value)


class PlainGain(_Part):
    """A drive whose force or torque is proportional to its recorded input: N·m or N per unit of drive."""

    kind: Literal["gain"]
    gain: Quantity
    inertia: Inertia | None = None


class Friction(_Part):
    """Friction that is known beforehand. `viscous` is that of (7.30), on the motor's side, and multiplies the motor's
    speed; `coulomb_arm` is μ̃ of (7.32)–(7.34), a length that multiplies the normal gravity force; `coulomb` is a plain
    torque at the joint."""

    viscous_motor_side: Annotated[Quantity, in_unit("N·m·s/rad", at_least=0.0)] | None = None
    viscous: Quantity | None = None
    coulomb_arm: Annotated[Quantity, in_unit("m", at_least=0.0)] | None = None
    coulomb: Quantity | None = None


class Sensor(_Part):
    """Position sensor: `range` of the joint over 2^bits counts, the joint's value at count 0, the sign of counting."""

    bits: Annotated[int, Field(ge=1, le=32)]
    range: JointValue
    at_zero: JointValue
    direction: Literal[-1, 1] = 1
    linearity: Plain | None = None
    noise: Annotated[Quantity, in_unit("count", at_least=0.0)] | None = None
    measures: Literal["position", "velocity"] = "position"


class Joint(_Part):
    """One joint with everything that belongs to it."""

    name: str
    kind: Literal["revolute", "prismatic"]
    geometry: Geometry
    link: Annotated[Cylinder | Rod | Body, Field(discriminator="shape")]
    drive: Annotated[DcMotor | PlainGain, Field(discriminator="kind")]
    friction: Friction = Friction()
    sensor: Sensor | None = None

    @property
    def dc_motor(self) -> DcMotor:
        """The motor. Raises SpecError when the drive is a plain gain."""
        if not isinstance(self.drive, DcMotor):
            raise SpecError(f"joint {self.name!r}: its drive is a plain gain, a dc_motor is needed here")
        return self.drive


class BoardPid(_Part):
    """The MA2000's own controller: integer PID on ADC counts, every `period`, its output `delay` later."""

    kind: Literal["board_pid"]
    period: Second
    delay: Second
    dac_counts_per_adc_count: Plain
    gains: tuple[tuple[int, int, int], ...]


class SampledPid(_Part):
    """PID in SI units, sampled: drive = P e + I ∫e dt + D de/dt. One row (P, I, D) per joint. `velocity_gains` closes
    an inner loop (cascade): the outer output is then a speed set point for it.

    The output is in the unit of the recorded drive. It is rounded to `drive_resolution`, then limited to
    ± `output_limit` ahead of the amplifier, whose dead zone and supply limit come after; at that limit the error is not
    integrated further. Set points are rounded to `set_point_resolution` before use. `gain_error` is relative: the
    output is 1 + `gain_error` times what the gains say. One number for all joints, or one a joint.
    """

    kind: Literal["pid"]
    period: Second
    delay: Second
    gains: tuple[tuple[float, float, float], ...]
    velocity_gains: tuple[tuple[float, float, float], ...] | None = None
    drive_resolution: Sizes | None = None
    output_limit: Sizes | None = None
    set_point_resolution: Sizes | None = None
    gain_error: Annotated[Quantity, in_unit("1", above=-1.0)] | tuple[Plain, ...] | None = None


def of_joint(sizes: Quantity | tuple[Quantity, ...] | None, joint: int) -> Quantity | None:
    """The number of joint `joint` (from 1), where one is stated for all joints or one a joint."""
    return sizes[joint - 1] if isinstance(sizes, tuple) else sizes


DEVIATIONS_ARE_USED_OF = (
    "lengths that are not 0, masses, centres, inertias, motor constants, gear ratio, supply and output limits, "
    "friction, at_zero, gains and delay"
)
"""Numbers of a machine file whose deviation becomes a tolerance parameter."""


class NoController(_Part):
    """No controller in the loop, or an unknown one: the recorded drive is the input."""

    kind: Literal["none"]


class Machine(_Part):
    """A machine file. `modelled_joints` are the joints (from 1) whose motion the model describes; the others are held
    and their mass is part of `load`, a point mass at the end of the last modelled link."""

    version: Literal[1]
    name: Annotated[str, Field(pattern=r"^[a-z0-9][a-z0-9_-]*$")]
    title: str
    notes: str = ""
    gravity: tuple[float, float, float]
    joints: Annotated[tuple[Joint, ...], Field(min_length=1, max_length=6)]
    modelled_joints: tuple[int, ...]
    load: Kilogram | None = None
    controller: Annotated[BoardPid | SampledPid | NoController, Field(discriminator="kind")]
    limits: Limits = Limits()
    rest_posture: tuple[float, ...] | None = None

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        count = len(self.joints)
        if self.modelled_joints != tuple(range(1, len(self.modelled_joints) + 1)) or len(self.modelled_joints) > count:
            raise ValueError(f"modelled_joints {list(self.modelled_joints)}: must be 1, 2, … up to at most {count}")
        if len(self.limits.joints) not in (0, count):
            raise ValueError(f"limits.joints has {len(self.limits.joints)} entries for {count} joints")
        if self.rest_posture is not None and len(self.rest_posture) != count:
            raise ValueError(f"rest_posture has {len(self.rest_posture)} values for {count} joints")
        if not isinstance(self.controller, NoController) and len(self.controller.gains) != count:
            raise ValueError(f"controller.gains has {len(self.controller.gains)} rows for {count} joints")
        if isinstance(self.controller, SampledPid):
            for name in ("drive_resolution", "output_limit", "set_point_resolution", "gain_error"):
                stated = getattr(self.controller, name)
                if isinstance(stated, tuple) and len(stated) != count:
                    raise ValueError(f"controller.{name} has {len(stated)} numbers for {count} joints")
            rows = self.controller.velocity_gains
            if rows is not None and len(rows) != count:
                raise ValueError(f"controller.velocity_gains has {len(rows)} rows for {count} joints")
        for place, quantity in self._quantities():
            if quantity.deviation is not None and not self._takes_deviation(place):
                raise ValueError(f"{place}: no method can use a deviation here, but of {DEVIATIONS_ARE_USED_OF}")
        return self

    def _quantities(self) -> Iterator[tuple[str, Quantity]]:
        """Every number of the whole machine and of the modelled joints, with its place in the file."""
        parts: list[tuple[str, object]] = [("controller", self.controller)]
        parts += [(f"joints.{j}", self.joints[j - 1]) for j in self.modelled_joints]
        while parts:
            place, part = parts.pop(0)
            if isinstance(part, Quantity):
                yield place, part
            elif isinstance(part, BaseModel):
                parts += [(f"{place}.{name}", getattr(part, name)) for name in type(part).model_fields]
            elif isinstance(part, tuple):
                parts += [(f"{place}.{k + 1}", one) for k, one in enumerate(part)]

    def _takes_deviation(self, place: str) -> bool:
        """Whether a model has a parameter for the deviation of the number at a place."""
        words = place.split(".")
        if words[0] == "controller":
            return words[1] in ("delay", "gain_error", "output_limit", "dac_counts_per_adc_count")
        joint, part = self.joint(int(words[1])), words[2]
        if part == "geometry":
            return words[3] in ("a", "d") and getattr(joint.geometry, words[3]).value != 0.0
        if part == "drive":
            return words[3] not in ("inductance", "amplifier_gain", "dac_full_scale")
        if part == "sensor":
            slides = joint.kind == "prismatic" and joint.geometry.d.value != 0.0  # its zero is link's `d` itself
            return words[3] == "at_zero" and not slides
        return True

    def calibration(self, joint: int) -> JointCalibration:
        """Counts and posture units ↔ rad of joint `joint` (from 1). Raises SpecError when it has no sensor."""
        sensor = self.joint(joint).sensor
        if sensor is None:
            raise SpecError(f"machine {self.name}: joint {joint} has no sensor, so no calibration")
        return JointCalibration(joint, sensor.range.value, sensor.at_zero.value, sensor.direction)

    def joint(self, number: int) -> Joint:
        """Joint `number` (from 1). Raises SpecError when there is none."""
        if not 1 <= number <= len(self.joints):
            raise SpecError(f"joint {number}: {self.name} has joints 1 to {len(self.joints)}")
        return self.joints[number - 1]


def parse_machine(text: str, origin: str = "machine file") -> Machine:
    """A machine from TOML text; `origin` names the file in errors. Raises SpecError with one line."""
    try:
        return Machine.model_validate(parse_toml(text, origin))
    except ValidationError as error:
        first = first_invalid(error)
        raise SpecError(f"{origin}: {first.where('machine', first=1)}: {first.message}") from error


def load_machine(name_or_path: str) -> Machine:
    """A shipped machine by name (`ma2000`) or any machine by the path of its file. Raises SpecError."""
    if name_or_path in shipped_machines():
        return _shipped(name_or_path)
    path = Path(name_or_path)
    if not os.path.lexists(path):
        known = ", ".join(shipped_machines())
        raise SpecError(f"machine {name_or_path!r:.200}: no such file, and not one of those that ship: {known}")
    return parse_machine(read_text(path, f"machine file {path}"), str(path))


def shipped_machines() -> tuple[str, ...]:
    """Names of the machines that ship."""
    folder = resources.files("daq.contracts") / "machines"
    return tuple(sorted(entry.name.removesuffix(".toml") for entry in folder.iterdir() if entry.name.endswith(".toml")))


@cache
def _shipped(name: str) -> Machine:
    file = resources.files("daq.contracts") / "machines" / f"{name}.toml"
    return parse_machine(file.read_text("utf-8"), f"{name}.toml")
