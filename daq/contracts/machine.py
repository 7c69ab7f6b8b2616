"""A machine as data: a serial chain of joints with drives, sensors, a controller and limits.

Every number carries its unit and its source, and says where it is an assumption. The file that ships is
`machines/ma2000.toml`; another rig is another file.
"""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator
from functools import cache
from importlib import resources
from operator import itemgetter
from pathlib import Path
from typing import Annotated, ClassVar, Literal, Self

from pydantic import AfterValidator, BaseModel, Field, FiniteFloat, ValidationError, model_validator

from daq.contracts.documents import parse_toml, read_text
from daq.contracts.errors import SpecError
from daq.contracts.frozen import FrozenRecord
from daq.contracts.limits import Limits
from daq.contracts.machine_form import SpelledOut
from daq.contracts.machine_units import (
    DRIVE_INERTIA,
    GAIN,
    POSITION,
    RECORDED,
    RECORDED_IN,
    TORQUE,
    UNITS,
    VISCOUS,
    JointUnits,
    drive_unit_of,
    require_unit,
    require_units,
)
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
from daq.contracts.refused import refusals
from daq.contracts.toml_places import places_of
from firmware_protocol.units import POSTURE_UNITS, DriveScale, JointCalibration


def _positive(quantity: Quantity) -> Quantity:
    if not quantity.value > 0.0:
        raise ValueError(f"value {quantity.value} {quantity.unit} must be above 0")
    return quantity


def _not_zero(quantity: Quantity) -> Quantity:
    if quantity.value == 0.0:
        raise ValueError(f"value {quantity.value} {quantity.unit} must not be 0")
    return quantity


Ratio = Annotated[Plain, AfterValidator(_not_zero)]
"""Of a gear; below 0 where motor and joint turn opposite ways."""
Product = Annotated[Quantity, in_unit("kg·m²")]
"""Of inertia, of either sign."""
Size = Annotated[Quantity, AfterValidator(_positive)]
Sizes = Size | tuple[Size, ...]
"""A number for all joints, or one a joint."""


class Geometry(FrozenRecord):
    """Standard Denavit–Hartenberg parameters (section 3.2 of the source): a, α, d, and the offset of θ (or d)."""

    a: Metre
    """Length along the link's x axis, the common normal."""
    alpha: Radian
    """Twist about x, from this joint's axis to the next one."""
    d: Metre
    """Offset along the joint's axis; added to the position of a prismatic joint."""
    theta: Radian
    """Angle about the joint's axis; added to the position of a revolute joint."""


class Cylinder(FrozenRecord):
    """A link turning about its own axis: I = ½ m r² about the joint (appendix B)."""

    shape: Literal["cylinder"]
    mass: Kilogram
    """Mass of the link."""
    radius: Metre
    """Radius about the joint's own axis."""


class Rod(FrozenRecord):
    """A thin uniform rod along the link's a: centre at a/2, I = m a²/12 about it (appendix B)."""

    shape: Literal["rod"]
    mass: Kilogram
    """Mass of the link, spread evenly over its length `a`."""


class Body(FrozenRecord):
    """A rigid body: centre of mass in the link's own frame (m), inertia about it: xx, yy, zz, xy, xz, yz."""

    shape: Literal["body"]
    mass: Kilogram
    """Mass of the link."""
    centre: tuple[Metre, Metre, Metre]
    """Centre of mass in the link's own frame: x, y, z."""
    inertia: tuple[Inertia, Inertia, Inertia, Product, Product, Product]
    """About the centre of mass: xx, yy, zz, xy, xz, yz."""


class DcMotor(FrozenRecord):
    """Permanent-magnet DC motor behind a linear amplifier and a gear (section 7.1 of the source).

    `gear_ratio` is motor turns per joint turn. `dac_full_scale` is the controller's output at 127 counts.
    """

    kind: Literal["dc_motor"]
    resistance: Annotated[Quantity, in_unit("Ω", above=0.0)]
    """Of the winding."""
    inductance: Annotated[Quantity, in_unit("H", at_least=0.0)]
    """Of the winding; used by the effect `motor_inductance` alone."""
    torque_constant: Annotated[Quantity, in_unit("N·m/A", above=0.0)]
    """Torque of the motor for a current."""
    back_emf_constant: Annotated[Quantity, in_unit("V·s/rad", at_least=0.0)]
    """Voltage for a speed of the motor."""
    rotor_inertia: Inertia
    """On the motor's side."""
    gear_ratio: Ratio
    """Motor turns per joint turn."""
    amplifier_gain: Plain
    """Volts at the motor for a volt of the board's output."""
    dac_full_scale: Volt
    """The board's output at 127 counts; of other controllers, with the gain, the largest voltage."""
    supply_limit: Volt | None = None
    """Largest voltage at the motor, behind the amplifier; none: no limit."""

    @property
    def scale(self) -> DriveScale:
        """DAC counts ↔ volts at the motor."""
        return DriveScale(self.dac_full_scale.value, self.amplifier_gain.value)


class PlainGain(FrozenRecord):
    """A drive whose force or torque is proportional to its recorded input: N·m or N per unit of drive."""

    kind: Literal["gain"]
    gain: Annotated[Quantity, GAIN]
    """Torque or force at the joint for a unit of the recorded drive (`N·m/V`, `N/N`): V, A, N·m, N, count, % or 1."""
    inertia: Annotated[Quantity, DRIVE_INERTIA, in_unit("kg·m²", "kg", at_least=0.0)] | None = None
    """Of the drive, at the joint; kg on a sliding joint."""


class CurrentDrive(FrozenRecord):
    """Motor whose recorded input is its current, in A: torque at the joint = torque_constant · gear_ratio · current."""

    kind: Literal["current"]
    torque_constant: Annotated[Quantity, in_unit("N·m/A", above=0.0)]
    """Torque of the motor for an ampere."""
    gear_ratio: Ratio
    """Motor turns per joint turn."""
    rotor_inertia: Inertia | None = None
    """On the motor's side."""


class Friction(FrozenRecord):
    """Friction that is known beforehand. `viscous` is that of (7.30), on the motor's side, and multiplies the motor's
    speed; `coulomb_arm` is μ̃ of (7.32)–(7.34), a length that multiplies the normal gravity force; `coulomb` is a plain
    torque at the joint."""

    viscous_motor_side: Annotated[Quantity, in_unit("N·m·s/rad", at_least=0.0)] | None = None
    """Per speed of the motor, on the motor's side."""
    viscous: Annotated[Quantity, VISCOUS] | None = None
    """Per speed of the joint, at the joint (N·m·s/rad, N·s/m)."""
    coulomb_arm: Annotated[Quantity, in_unit("m", at_least=0.0)] | None = None
    """Lever of the friction that grows with the load."""
    coulomb: Annotated[Quantity, TORQUE] | None = None
    """Constant friction at the joint (N·m, N)."""


class Sensor(FrozenRecord):
    """Position sensor: `range` of the joint over 2^bits counts, the joint's value at count 0, the sign of counting."""

    bits: Annotated[int, Field(ge=1, le=32)]
    """Its range has 2^bits counts."""
    range: Annotated[JointValue, AfterValidator(_positive)]
    """Of the joint, over all counts."""
    at_zero: JointValue
    """Position of the joint at count 0; a deviation turns the link against what the sensor shows."""
    direction: Literal[-1, 1] = 1
    """1: counts grow with the position; −1: they fall."""
    linearity: Plain | None = None
    """Largest bend, as a share of the range, that a sound sensor may have."""
    noise: Annotated[Quantity, in_unit("count", at_least=0.0)] | None = None
    """Standard deviation before rounding."""
    measures: Literal["position", "velocity"] = "position"
    """A tachometer measures velocity, which is integrated from 0."""


class Joint(FrozenRecord):
    """One joint with everything that belongs to it."""

    name: str
    """For people."""
    kind: Literal["revolute", "prismatic"]
    """Turns about its z axis, or slides along it; both are the z axis of the frame before its own geometry."""
    geometry: Geometry
    """See Geometry."""
    link: Annotated[Cylinder | Rod | Body, Field(discriminator="shape")]
    """See Cylinder, Rod and Body."""
    drive: Annotated[DcMotor | CurrentDrive | PlainGain, Field(discriminator="kind")]
    """See DcMotor, CurrentDrive and PlainGain."""
    friction: Friction = Friction()
    """See Friction."""
    sensor: Sensor | None = None
    """See Sensor; none: exact positions."""

    @model_validator(mode="after")
    def _units_suit(self) -> Self:
        units, drive, sensor = UNITS[self.kind], self.drive, self.sensor
        require_unit("friction.viscous", self.friction.viscous, (units.viscous,), units.what)
        require_unit("friction.coulomb", self.friction.coulomb, (units.torque,), units.what)
        if isinstance(drive, PlainGain):
            drive_unit_of(drive.gain, units)
            require_unit("drive.inertia", drive.inertia, units.inertia, units.what)
        if sensor is not None and sensor.measures == "position":
            require_unit("sensor.range", sensor.range, (units.position,), units.what)
            require_unit("sensor.at_zero", sensor.at_zero, (units.position,), units.what)
        return self

    @property
    def units(self) -> JointUnits:
        """Units of position, torque (force) and friction at the joint."""
        return UNITS[self.kind]

    @property
    def drive_units(self) -> tuple[str, ...]:
        """The units that its recorded drive may have: one, but for a gain that does not say it."""
        if isinstance(self.drive, PlainGain):
            stated = drive_unit_of(self.drive.gain, self.units)
            return RECORDED_IN if stated is None else (stated,)
        return ("V",) if isinstance(self.drive, DcMotor) else ("A",)

    @property
    def dc_motor(self) -> DcMotor:
        """The motor. Raises SpecError when the drive is none."""
        if not isinstance(self.drive, DcMotor):
            raise SpecError(f"joint {self.name!r}: its drive is a {self.drive.kind}, a dc_motor is needed here")
        return self.drive


class BoardPid(FrozenRecord):
    """The MA2000's own controller: integer PID on ADC counts, every `period`, its output `delay` later."""

    kind: Literal["board_pid"]
    period: Second
    """Of control."""
    delay: Second
    """From reading a position to the change of the drive."""
    dac_counts_per_adc_count: Plain
    """Output for an error of one count, per unit of P; a deviation is one of the gains."""
    gains: tuple[tuple[int, int, int], ...]
    """P, I, D per joint; a record's own gains come before these."""


class SampledPid(FrozenRecord):
    """PID in SI units, sampled: drive = P e + I ∫e dt + D de/dt. One row (P, I, D) per joint. `velocity_gains` closes
    an inner loop (cascade): the outer output is then a speed set point for it.

    The output is in the unit of the recorded drive. It is rounded to `drive_resolution`, then limited to
    ± `output_limit` ahead of the amplifier, whose dead zone and supply limit come after; at that limit the error is not
    integrated further. Set points are rounded to `set_point_resolution` before use. `gain_error` is relative: the
    output is 1 + `gain_error` times what the gains say. One number for all joints, or one a joint.
    """

    kind: Literal["pid"]
    period: Second
    """Of control."""
    delay: Second
    """From reading a position to the change of the drive."""
    gains: tuple[tuple[FiniteFloat, FiniteFloat, FiniteFloat], ...]
    """P (drive's unit per rad or m), I (per rad·s), D (s/rad) per joint."""
    velocity_gains: tuple[tuple[FiniteFloat, FiniteFloat, FiniteFloat], ...] | None = None
    """P, I, D per joint of an inner loop on speed; none: no such loop."""
    drive_resolution: Annotated[Sizes, RECORDED] | None = None
    """Step of the output, unit of the drive; none: not rounded."""
    output_limit: Annotated[Sizes, RECORDED] | None = None
    """Largest output, unit of the drive, ahead of the amplifier; none: no limit."""
    set_point_resolution: Annotated[Sizes, POSITION] | None = None
    """Step to which set points are rounded before use, rad or m; none: not rounded."""
    dead_band: Annotated[Sizes, POSITION] | None = None
    """Error, either way, on which it does not act, rad or m; none: it acts on every error."""
    gain_error: Annotated[Quantity, in_unit("1", above=-1.0)] | tuple[Plain, ...] | None = None
    """Relative: the output is 1 + this times what the gains say; its deviation is that of the gains."""


def of_joint(sizes: Quantity | tuple[Quantity, ...] | None, joint: int) -> Quantity | None:
    """The number of joint `joint` (from 1), where one is stated for all joints or one a joint."""
    return sizes[joint - 1] if isinstance(sizes, tuple) else sizes


DEVIATIONS_ARE_USED_OF = (
    "lengths that are not 0, masses, centres, inertias, motor constants, gear ratio, supply and output limits, "
    "friction, at_zero, gains and delay"
)
"""Numbers of a machine file whose deviation becomes a tolerance parameter."""


class NoController(FrozenRecord):
    """No controller in the loop, or an unknown one: the recorded drive is the input."""

    kind: Literal["none"]


class Machine(FrozenRecord):
    """A machine file. `modelled_joints` are the joints (from 1) whose motion the model describes; the others are held
    and their mass is part of `load`, a point mass at the end of the last modelled link."""

    shown: ClassVar[tuple[str, ...]] = ("name", "title", "modelled_joints")
    version: Literal[1]
    """Of the format."""
    name: Annotated[str, Field(pattern=r"^[a-z0-9][a-z0-9_-]*$")]
    """For files and commands."""
    title: str
    """For people."""
    notes: str = ""
    """For people."""
    gravity: tuple[FiniteFloat, FiniteFloat, FiniteFloat]
    """In the base's axes, m/s²."""
    joints: Annotated[tuple[Joint, ...], Field(min_length=1)]
    """From the base on; see Joint."""
    modelled_joints: tuple[int, ...]
    """1, 2, … up to the last joint that moves in the model; the others are held."""
    load: Kilogram | None = None
    """A point at the end of the last modelled link, the held joints' mass included."""
    controller: Annotated[BoardPid | SampledPid | NoController, Field(discriminator="kind")]
    """See BoardPid, SampledPid and NoController."""
    limits: Limits = Limits()
    """What the arm may do ([safety](safety.md)): experiments are planned within it."""
    rest_posture: tuple[Annotated[FiniteFloat, POSITION], ...] | None = None
    """Position of every joint at rest, rad or m: where springs are expected to be slack."""

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
            for name in ("drive_resolution", "output_limit", "set_point_resolution", "dead_band", "gain_error"):
                stated = getattr(self.controller, name)
                if isinstance(stated, tuple) and len(stated) != count:
                    raise ValueError(f"controller.{name} has {len(stated)} numbers for {count} joints")
                if name != "gain_error":
                    positions = name in ("set_point_resolution", "dead_band")
                    allowed = [(j.units.position,) if positions else j.drive_units for j in self.joints]
                    require_units(f"controller.{name}", stated, allowed)
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
        step = of_joint(getattr(self.controller, "set_point_resolution", None), joint)
        units = POSTURE_UNITS if step is None else round(sensor.range.value / step.value)
        return JointCalibration(
            joint, sensor.range.value, sensor.at_zero.value, sensor.direction, 2**sensor.bits, max(units, 1)
        )

    def drive_scale(self, joint: int) -> DriveScale:
        """Counts of the controller's output ↔ motor volts, on joint `joint` (from 1): by the step of a sampled
        controller's output where it is stated. Raises SpecError for a joint without a DC motor."""
        motor = self.joint(joint).dc_motor
        step = of_joint(getattr(self.controller, "drive_resolution", None), joint)
        return motor.scale if step is None else DriveScale(step.value, 1.0, 1)

    def drive_sign(self, joint: int) -> int:
        """Sign of the drive for a positive output of the board's controller, on joint `joint` (from 1).

        The controller works in counts, so on any arm that comes to rest a positive output makes the counts grow: a
        sensor that counts down, or a gear that turns the motion round, belongs to a motor that is connected the other
        way.
        """
        sensor, drive = self.joint(joint).sensor, self.joint(joint).drive
        counting = 1 if sensor is None else sensor.direction
        return counting if (drive.gain if isinstance(drive, PlainGain) else drive.gear_ratio).value > 0 else -counting

    def joint(self, number: int) -> Joint:
        """Joint `number` (from 1). Raises SpecError when there is none."""
        if not 1 <= number <= len(self.joints):
            raise SpecError(f"joint {number}: {self.name} has joints 1 to {len(self.joints)}")
        return self.joints[number - 1]


def joint_names(machine: Machine | None, joints: tuple[int, ...]) -> tuple[str, ...]:
    """Names of joints: the machine's, or joint_1 and so on where it is not known or has fewer."""
    if machine is None or max(joints) > len(machine.joints):
        return tuple(f"joint_{joint}" for joint in joints)
    return tuple(machine.joint(joint).name for joint in joints)


LONGEST_MISTAKE = 400
"""Most characters of what is said of one mistake in a file."""


def parse_machine(text: str, origin: str = "machine file") -> Machine:
    """A machine from TOML text, in the short form or in full; `origin` names the file in errors.

    Raises SpecError with a line for each mistake: where, the field, what was found, what is allowed.
    """
    data = parse_toml(text, origin)
    places = places_of(text)
    written = SpelledOut(data, Machine, places)
    found = [(path, f"{'.'.join(_shown_place(path)) or 'machine'}: {words}") for path, words in written.problems]
    told = [*(path for path, _ in found), *written.elsewhere]
    try:
        machine = Machine.model_validate(written.data)
    except ValidationError as error:
        refused = refusals(error, Machine, "machine")
        found += [one for one in refused if not any(one[0][: len(own)] == own for own in told)]
    else:
        if not found:
            return machine
    lines = sorted(((places.line(path or _named_place(words)) or 0, words) for path, words in found), key=itemgetter(0))
    said = [_within_a_line(words if not line else f"line {line}: {words}") for line, words in lines]
    raise SpecError(
        f"{origin}: {said[0]}" if len(said) == 1 else "\n  ".join([f"{origin}: {len(said)} mistakes", *said])
    )


def _within_a_line(words: str) -> str:
    """The words without their middle, if what was found in the file made them very long."""
    return (
        words
        if len(words) <= LONGEST_MISTAKE
        else f"{words[: LONGEST_MISTAKE // 2]} … {words[-LONGEST_MISTAKE // 2 :]}"
    )


def _shown_place(path: Iterable[int | str]) -> Iterator[str]:
    return (str(part + 1) if isinstance(part, int) else part for part in path)


def _named_place(words: str) -> tuple[int | str, ...]:
    """The path of the place that the words about a whole machine begin with, if they do."""
    parts = words.removeprefix("machine: ").partition(" ")[0].rstrip(":").split(".")
    return tuple(int(part) - 1 if part.isdecimal() else part for part in parts)


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
