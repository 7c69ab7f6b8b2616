"""A machine as data: a serial chain of joints with drives, sensors, a controller and limits.

Every number has its unit and its source, and is marked if it is an assumption. The packaged file is
`machines/ma2000.toml`; other machines have other files.
"""

from __future__ import annotations

import math
import os
from collections.abc import Iterable, Iterator
from functools import cache
from importlib import resources
from operator import itemgetter
from pathlib import Path
from typing import Annotated, ClassVar, Literal, Self

from pydantic import AfterValidator, BaseModel, Field, FiniteFloat, ValidationError, model_validator

from daq.contracts.documents import parse_toml, read_text
from daq.contracts.errors import MISTAKE, SpecError
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
from daq.contracts.quantity import Inertia, JointValue, Kilogram, Metre, Plain, Quantity, Radian, Second, Volt, in_unit
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
"""Gear ratio; negative if motor and joint turn in opposite directions."""
Product = Annotated[Quantity, in_unit("kg·m²")]
"""A product of inertia, of either sign."""
Size = Annotated[Quantity, AfterValidator(_positive)]
Sizes = Size | tuple[Size, ...]
"""One number for all joints, or one per joint."""


class Geometry(FrozenRecord):
    """Standard Denavit–Hartenberg parameters (section 3.2 of the source): a, α, d, and the offset of θ (or d)."""

    a: Metre
    """Link length a along the link's x axis, the common normal."""
    alpha: Radian
    """Twist α about x, from this joint's axis to the next one."""
    d: Metre
    """Offset d along the joint's axis; added to the position of a prismatic joint."""
    theta: Radian
    """Offset θ about the joint's axis; added to the position of a revolute joint."""


class Cylinder(FrozenRecord):
    """A link that rotates about its own axis: I = ½ m r² about the joint (appendix B)."""

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
    """A rigid body: mass, centre of mass (m, in the link's frame), and inertia about it: xx, yy, zz, xy, xz, yz."""

    shape: Literal["body"]
    mass: Kilogram
    """Mass of the link."""
    centre: tuple[Metre, Metre, Metre]
    """Centre of mass in the link's own frame: x, y, z."""
    inertia: tuple[Inertia, Inertia, Inertia, Product, Product, Product]
    """Inertia about the centre of mass: xx, yy, zz, xy, xz, yz."""


class DcMotor(FrozenRecord):
    """Permanent-magnet DC motor with a linear amplifier and a gear (section 7.1 of the source).

    `gear_ratio`: motor turns per joint turn. `dac_full_scale`: the controller's output at 127 counts.
    """

    kind: Literal["dc_motor"]
    resistance: Annotated[Quantity, in_unit("Ω", above=0.0)]
    """Resistance of the winding."""
    inductance: Annotated[Quantity, in_unit("H", at_least=0.0)]
    """Inductance of the winding; only the effect `motor_inductance` uses it."""
    torque_constant: Annotated[Quantity, in_unit("N·m/A", above=0.0)]
    """Motor torque per current."""
    back_emf_constant: Annotated[Quantity, in_unit("V·s/rad", at_least=0.0)]
    """Voltage per motor speed."""
    rotor_inertia: Inertia
    """Rotor inertia, on the motor side of the gear."""
    gear_ratio: Ratio
    """Motor turns per joint turn."""
    amplifier_gain: Plain
    """Motor volts per volt of the board's output."""
    dac_full_scale: Volt | None = None
    """The board's output at 127 counts. With other controllers, this times `amplifier_gain` is the largest voltage, and
    none means no such limit."""
    supply_limit: Volt | None = None
    """Largest voltage at the motor, after the amplifier; none: no limit."""

    @property
    def scale(self) -> DriveScale:
        """DAC counts ↔ volts at the motor. Raises SpecError if `dac_full_scale` is not stated."""
        if self.dac_full_scale is None:
            raise SpecError("drive: dac_full_scale is not stated: counts of the drive have no volts")
        return DriveScale(self.dac_full_scale.value, self.amplifier_gain.value)

    @property
    def largest_output(self) -> float:
        """The controller's largest output, in V at the motor; inf if it is not stated."""
        if self.dac_full_scale is None:
            return math.inf
        return abs(self.dac_full_scale.value * self.amplifier_gain.value)

    @property
    def highest(self) -> float:
        """Largest voltage at the motor, V; inf if none is stated."""
        return min(self.largest_output, math.inf if self.supply_limit is None else self.supply_limit.value)


class PlainGain(FrozenRecord):
    """A drive whose torque or force is proportional to its recorded input: N·m or N per unit of drive."""

    kind: Literal["gain"]
    gain: Annotated[Quantity, GAIN]
    """Torque or force at the joint per unit of the recorded drive (`N·m/V`, `N/N`): V, A, N·m, N, count, % or 1."""
    inertia: Annotated[Quantity, DRIVE_INERTIA, in_unit("kg·m²", "kg", at_least=0.0)] | None = None
    """Inertia of the drive at the joint; mass (kg) on a prismatic joint."""


class CurrentDrive(FrozenRecord):
    """Motor whose recorded input is its current, in A: torque at the joint = torque_constant · gear_ratio · current."""

    kind: Literal["current"]
    torque_constant: Annotated[Quantity, in_unit("N·m/A", above=0.0)]
    """Motor torque per ampere."""
    gear_ratio: Ratio
    """Motor turns per joint turn."""
    rotor_inertia: Inertia | None = None
    """Rotor inertia, on the motor side of the gear."""


class Friction(FrozenRecord):
    """Known friction. `viscous` is that of (7.30): it multiplies the motor's speed, on the motor side. `coulomb_arm` is
    μ̃ of (7.32)–(7.34), a length that multiplies the normal gravity force. `coulomb` is a constant torque at the
    joint."""

    viscous_motor_side: Annotated[Quantity, in_unit("N·m·s/rad", at_least=0.0)] | None = None
    """Torque per motor speed, on the motor side."""
    viscous: Annotated[Quantity, VISCOUS] | None = None
    """Torque or force per joint speed, at the joint (N·m·s/rad, N·s/m)."""
    coulomb_arm: Annotated[Quantity, in_unit("m", at_least=0.0)] | None = None
    """Lever arm of the friction that grows with the load."""
    coulomb: Annotated[Quantity, TORQUE] | None = None
    """Constant friction torque or force at the joint (N·m, N)."""


class Sensor(FrozenRecord):
    """Position sensor: `range` of the joint over 2^bits counts, the joint's position at count 0, the sign of
    counting."""

    bits: Annotated[int, Field(ge=1, le=32)] | None = None
    """Resolution: the range has 2^bits counts; none: noise is estimated from the record."""
    range: Annotated[JointValue, AfterValidator(_positive)]
    """Range of the joint over all counts."""
    at_zero: JointValue
    """Joint position at count 0. A deviation rotates the link against the sensor's reading."""
    direction: Literal[-1, 1] = 1
    """1: counts increase with the position; −1: they decrease."""
    linearity: Plain | None = None
    """Largest nonlinearity of a healthy sensor, as a share of the range."""
    noise: Annotated[Quantity, in_unit("count", at_least=0.0)] | None = None
    """Standard deviation of the noise before rounding."""
    measures: Literal["position", "velocity"] = "position"
    """`velocity`: a tachometer, whose signal is integrated from 0."""

    @model_validator(mode="after")
    def _noise_has_counts(self) -> Self:
        if self.noise is not None and self.bits is None:
            raise ValueError("noise is stated in counts, so `bits` is needed")
        return self

    @property
    def count(self) -> float:
        """One count, rad or m; 0 if `bits` is not stated."""
        return 0.0 if self.bits is None else self.range.value / 2**self.bits


class Joint(FrozenRecord):
    """One joint with all its parts."""

    name: str
    """For people."""
    kind: Literal["revolute", "prismatic"]
    """Revolute: turns about its z axis; prismatic: slides along it. The axis is z of the frame before its own
    geometry."""
    geometry: Geometry
    """See Geometry."""
    link: Annotated[Cylinder | Rod | Body, Field(discriminator="shape")]
    """See Cylinder, Rod and Body."""
    drive: Annotated[DcMotor | CurrentDrive | PlainGain, Field(discriminator="kind")]
    """See DcMotor, CurrentDrive and PlainGain."""
    friction: Friction = Friction()
    """See Friction."""
    sensor: Sensor | None = None
    """See Sensor; none: positions are exact."""

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
        """Units that the recorded drive may have. There is one, unless the drive is a gain without a stated unit."""
        if isinstance(self.drive, PlainGain):
            stated = drive_unit_of(self.drive.gain, self.units)
            return RECORDED_IN if stated is None else (stated,)
        return ("V",) if isinstance(self.drive, DcMotor) else ("A",)

    @property
    def count(self) -> float:
        """One count of the sensor, rad or m; 0 if it is not stated."""
        return 0.0 if self.sensor is None else self.sensor.count

    @property
    def dc_motor(self) -> DcMotor:
        """The DC motor. Raises SpecError for another kind of drive."""
        if not isinstance(self.drive, DcMotor):
            raise SpecError(f"joint {self.name!r}: its drive is a {self.drive.kind}, a dc_motor is needed here")
        return self.drive


class BoardPid(FrozenRecord):
    """The MA2000's own controller: integer PID on ADC counts once per `period`; its output acts `delay` later."""

    kind: Literal["board_pid"]
    period: Second
    """Control period."""
    delay: Second
    """Time from reading a position to the change of the drive."""
    dac_counts_per_adc_count: Plain
    """Output for an error of one count, per unit of P. Its deviation is that of the gains."""
    gains: tuple[tuple[int, int, int], ...]
    """P, I, D per joint; gains in a record replace these."""


class SampledPid(FrozenRecord):
    """Sampled PID in SI units: drive = P e + I ∫e dt + D de/dt. One row (P, I, D) per joint. `velocity_gains` adds an
    inner loop (cascade), whose set point is the output of the outer one.

    The output has the unit of the recorded drive. It is rounded to `drive_resolution`, then limited to ±
    `output_limit`; the amplifier's dead zone and supply limit follow. At the limit, the error is not integrated
    further. Set points are rounded to `set_point_resolution` before use. `gain_error` is relative: the output is 1 +
    `gain_error` times the output by the gains. All of these are one number for all joints, or one per joint.
    """

    kind: Literal["pid"]
    period: Second
    """Control period."""
    delay: Second
    """Time from reading a position to the change of the drive."""
    gains: tuple[tuple[FiniteFloat, FiniteFloat, FiniteFloat], ...]
    """P (drive unit per rad or m), I (per rad·s), D (s/rad) per joint."""
    velocity_gains: tuple[tuple[FiniteFloat, FiniteFloat, FiniteFloat], ...] | None = None
    """P, I, D per joint of an inner speed loop; none: no such loop."""
    drive_resolution: Annotated[Sizes, RECORDED] | None = None
    """Step of the output, in the drive's unit; none: not rounded."""
    output_limit: Annotated[Sizes, RECORDED] | None = None
    """Largest output, in the drive's unit, before the amplifier; none: no limit."""
    set_point_resolution: Annotated[Sizes, POSITION] | None = None
    """Step to which set points are rounded before use (rad or m); none: not rounded."""
    dead_band: Annotated[Sizes, POSITION] | None = None
    """Largest absolute error that the controller ignores (rad or m); none: no dead band."""
    gain_error: Annotated[Quantity, in_unit("1", above=-1.0)] | tuple[Plain, ...] | None = None
    """Relative gain error: the output is 1 + this times the output by the gains. Its deviation is that of the gains."""


def of_joint(sizes: Quantity | tuple[Quantity, ...] | None, joint: int) -> Quantity | None:
    """Returns the number for joint `joint` (from 1), if there is one for all joints or one per joint."""
    return sizes[joint - 1] if isinstance(sizes, tuple) else sizes


DEVIATIONS_ARE_USED_OF = (
    "lengths that are not 0, masses, centres, inertias, motor constants, gear ratio, supply and output limits, "
    "friction, at_zero, gains and delay"
)
"""Numbers of a machine file whose deviation becomes an uncertain parameter of the model."""


class NoController(FrozenRecord):
    """No controller in the loop, or an unknown one: the recorded drive is the model's input."""

    kind: Literal["none"]


class Machine(FrozenRecord):
    """A machine file. `modelled_joints`: the joints (from 1) whose motion the model describes. The others are held
    still, and their mass is part of `load`, a point mass at the end of the last modelled link."""

    shown: ClassVar[tuple[str, ...]] = ("name", "title", "modelled_joints")
    version: Literal[1]
    """Format version."""
    name: Annotated[str, Field(pattern=r"^[a-z0-9][a-z0-9_-]*$")]
    """Name for files and commands."""
    title: str
    """Name for people."""
    notes: str = ""
    """Remarks for people."""
    gravity: tuple[FiniteFloat, FiniteFloat, FiniteFloat]
    """Gravity in the base frame, m/s²."""
    joints: Annotated[tuple[Joint, ...], Field(min_length=1)]
    """Joints from the base on; see Joint."""
    modelled_joints: tuple[int, ...]
    """1, 2, … up to the last joint that moves in the model; the others are held still."""
    load: Kilogram | None = None
    """Point mass at the end of the last modelled link, including the mass of the held joints."""
    controller: Annotated[BoardPid | SampledPid | NoController, Field(discriminator="kind")]
    """See BoardPid, SampledPid and NoController."""
    limits: Limits = Limits()
    """Limits of the arm ([safety](safety.md)); experiments are planned within them."""
    rest_posture: tuple[Annotated[FiniteFloat, POSITION], ...] | None = None
    """Position of every joint at rest, rad or m, where springs are expected to be slack."""

    @model_validator(mode="after")
    def _board_has_counts(self) -> Self:
        for number, joint in enumerate(self.joints if isinstance(self.controller, BoardPid) else (), start=1):
            drive, sensor = joint.drive, joint.sensor
            if isinstance(drive, DcMotor) and drive.dac_full_scale is None:
                raise ValueError(f"joints.{number}.drive.dac_full_scale: is missing; a board_pid works in its counts")
            if sensor is not None and sensor.bits is None:
                raise ValueError(f"joints.{number}.sensor.bits: is missing; a board_pid works in its counts")
        return self

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
        """Yields every number of the whole machine and of the modelled joints, with its place in the file."""
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
        """Whether a model has a parameter for the deviation of the number at this place."""
        words = place.split(".")
        if words[0] == "controller":
            return words[1] in ("delay", "gain_error", "output_limit", "dac_counts_per_adc_count")
        joint, part = self.joint(int(words[1])), words[2]
        if part == "geometry":
            return words[3] in ("a", "d") and getattr(joint.geometry, words[3]).value != 0.0
        if part == "drive":
            return words[3] not in ("inductance", "amplifier_gain", "dac_full_scale")
        if part == "sensor":
            # the joint's zero is the link's `d` itself
            slides = joint.kind == "prismatic" and joint.geometry.d.value != 0.0
            return words[3] == "at_zero" and not slides
        return True

    def calibration(self, joint: int) -> JointCalibration:
        """Returns the conversion of counts and posture units to rad for joint `joint` (from 1). Raises SpecError if it
        has no sensor."""
        sensor = self.joint(joint).sensor
        if sensor is None or sensor.bits is None:
            lacking = "sensor" if sensor is None else "sensor.bits"
            raise SpecError(f"machine {self.name}: joint {joint} has no {lacking}, so no calibration")
        step = of_joint(getattr(self.controller, "set_point_resolution", None), joint)
        units = POSTURE_UNITS if step is None else round(sensor.range.value / step.value)
        return JointCalibration(
            joint, sensor.range.value, sensor.at_zero.value, sensor.direction, 2**sensor.bits, max(units, 1)
        )

    def drive_scale(self, joint: int) -> DriveScale:
        """Returns the conversion of controller output counts to motor volts for joint `joint` (from 1). Uses the output
        step of a sampled controller, if it is given. Raises SpecError for a joint without a DC motor."""
        motor = self.joint(joint).dc_motor
        step = of_joint(getattr(self.controller, "drive_resolution", None), joint)
        return motor.scale if step is None else DriveScale(step.value, 1.0, 1)

    def drive_sign(self, joint: int) -> int:
        """Sign of the drive for a positive output of the board's controller, on joint `joint` (from 1).

        The controller works in counts, so on any arm that comes to rest, a positive output increases the counts. If the
        sensor counts down, or the gear reverses the motion, the motor must be connected the other way round.
        """
        sensor, drive = self.joint(joint).sensor, self.joint(joint).drive
        counting = 1 if sensor is None else sensor.direction
        return counting if (drive.gain if isinstance(drive, PlainGain) else drive.gear_ratio).value > 0 else -counting

    def joint(self, number: int) -> Joint:
        """Returns joint `number` (from 1). Raises SpecError if there is none."""
        if not 1 <= number <= len(self.joints):
            raise SpecError(f"joint {number}: {self.name} has joints 1 to {len(self.joints)}")
        return self.joints[number - 1]


def joint_names(machine: Machine | None, joints: tuple[int, ...]) -> tuple[str, ...]:
    """Returns the machine's names of joints, or joint_1 and so on if the machine is unknown or has fewer joints."""
    if machine is None or max(joints) > len(machine.joints):
        return tuple(f"joint_{joint}" for joint in joints)
    return tuple(machine.joint(joint).name for joint in joints)


LONGEST_MISTAKE = 400
"""Most characters in the message about one mistake in a file."""


def parse_machine(text: str, origin: str = "machine file") -> Machine:
    """Returns a machine from TOML text, in the short or the full form; `origin` names the file in errors.

    Raises SpecError with a line per mistake: where, the field, what was found, what is allowed.
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
        f"{origin}: {said[0]}" if len(said) == 1 else MISTAKE.join([f"{origin}: {len(said)} mistakes", *said])
    )


def _within_a_line(words: str) -> str:
    """Shortens a very long message by leaving out its middle."""
    return (
        words
        if len(words) <= LONGEST_MISTAKE
        else f"{words[: LONGEST_MISTAKE // 2]} … {words[-LONGEST_MISTAKE // 2 :]}"
    )


def _shown_place(path: Iterable[int | str]) -> Iterator[str]:
    return (str(part + 1) if isinstance(part, int) else part for part in path)


def _named_place(words: str) -> tuple[int | str, ...]:
    """Returns the path at the beginning of a message about a whole machine, if it has one."""
    parts = words.removeprefix("machine: ").partition(" ")[0].rstrip(":").split(".")
    return tuple(int(part) - 1 if part.isdecimal() else part for part in parts)


def load_machine(name_or_path: str) -> Machine:
    """Returns a packaged machine by name (`ma2000`), or any machine by the path of its file. Raises SpecError."""
    if name_or_path in shipped_machines():
        return _shipped(name_or_path)
    path = Path(name_or_path)
    if not os.path.lexists(path):
        known = ", ".join(shipped_machines())
        raise SpecError(f"machine {name_or_path!r:.200}: no such file, and not a packaged machine: {known}")
    return parse_machine(read_text(path, f"machine file {path}"), str(path))


def shipped_machines() -> tuple[str, ...]:
    """Names of the packaged machines."""
    folder = resources.files("daq.contracts") / "machines"
    return tuple(sorted(entry.name.removesuffix(".toml") for entry in folder.iterdir() if entry.name.endswith(".toml")))


@cache
def _shipped(name: str) -> Machine:
    file = resources.files("daq.contracts") / "machines" / f"{name}.toml"
    return parse_machine(file.read_text("utf-8"), f"{name}.toml")
