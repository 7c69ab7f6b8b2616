"""Experiments: a trajectory on some joints from a start posture, with gains, holds and repeats. Angles in rad."""

from __future__ import annotations

import math
import re
import sys
from collections.abc import Callable
from dataclasses import dataclass
from typing import Annotated, Any, Literal, Self

from pydantic import BaseModel, Field, FiniteFloat, GetCoreSchemaHandler, StrictBool, ValidationError, model_validator
from pydantic_core import CoreSchema, PydanticCustomError, core_schema

from daq.contracts.documents import shown
from daq.contracts.errors import SpecError
from daq.contracts.frozen import FrozenRecord, UserRecord
from firmware_protocol.invalid import first_invalid, invalid_of

BOUNDS = ("greater_than", "greater_than_equal", "less_than", "less_than_equal")
"""Pydantic's names of the errors for a number outside its bounds."""


@dataclass(frozen=True)
class InUnit:
    """Marks a field, after its bounds: `Annotated[float, Field(gt=0), InUnit("s")]`."""

    unit: str

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        """Adds the unit to errors about the bounds."""
        return core_schema.no_info_wrap_validator_function(self._told, handler(source))

    def _told(self, value: Any, validate: Callable[[Any], Any]) -> Any:
        try:
            return validate(value)
        except ValidationError as error:
            first = error.errors()[0]
            if first["type"] not in BOUNDS:
                raise
            raise PydanticCustomError(first["type"], f"{first['msg']} {self.unit}", first.get("ctx")) from None


JOINTS = 6
GAIN_LOCATION_LENGTH = 3
"""Length of pydantic's error location of one gain: the field, the joint, which of P, I, D."""
DEFAULT_AMPLITUDE = math.radians(21.6)
"""Amplitude of the default ramp: 21.6°, that is 80 posture units (section 6.5 of the source)."""
DEFAULT_RAMP_TIME = 0.65
"""Duration of the ramp in s (section 6.5)."""

LONGEST_SHOWN = 60
"""Length up to which an error message repeats a wrong text in full."""

MOST_POINTS = 1_000_000
"""Most points of a path: four hours of set points at 50 Hz are 720 000."""

Duration = Annotated[FiniteFloat, Field(gt=0, le=3600), InUnit("s")]
Hold = Annotated[FiniteFloat, Field(ge=0, le=3600), InUnit("s")]
JointNumber = Annotated[int, Field(ge=1, le=JOINTS)]
Angle = Annotated[FiniteFloat, Field(ge=-2 * math.pi, le=2 * math.pi), InUnit("rad")]
Row = Annotated[tuple[Angle, ...], Field(fail_fast=True)]
"""Angles of joints at one moment. Validation of a long list stops at its first error (`fail_fast`): collecting a
million errors takes minutes."""
Count = Annotated[int, Field(ge=0)]
GainValue = Annotated[int, Field(ge=0, le=20)]
Gain = tuple[GainValue, GainValue, GainValue]
"""P, I, D of one joint, each 0–20 (section 6.2)."""
ReportedGain = tuple[Count, Count, Count]
"""P, I, D of one joint as a controller reports them, in its own units and range."""
Amplitude = Angle | dict[JointNumber, Angle]
"""One value for all joints of the experiment, or one per joint."""


class _UserRecord(UserRecord):
    """A part of an experiment. Users also construct it in Python, so validation errors become one-line SpecErrors."""

    @classmethod
    def words_of(cls, error: ValidationError) -> str:
        """States the field, what is allowed and what was given; angles in degrees, as people type them."""
        return _one_line(error)


class Ramp(_UserRecord):
    """Constant speed through `amplitude` in `duration`; all joints arrive together."""

    kind: Literal["ramp"] = "ramp"
    amplitude: Amplitude = DEFAULT_AMPLITUDE
    duration: Duration = DEFAULT_RAMP_TIME


class Step(_UserRecord):
    """The whole `amplitude` at once, in one set point."""

    kind: Literal["step"] = "step"
    amplitude: Amplitude = math.radians(5.4)


class Staircase(_UserRecord):
    """Moves through `amplitude` in `steps` equal steps and, if `back`, down again, `dwell` s on each step."""

    kind: Literal["staircase"] = "staircase"
    amplitude: Amplitude = DEFAULT_AMPLITUDE
    steps: Annotated[int, Field(ge=1, le=200)] = 8
    dwell: Duration = 0.5
    back: StrictBool = True


class SlowRamp(_UserRecord):
    """Moves at constant low speed out to `amplitude` and back, with `reversals` changes of direction. Shows
    friction."""

    kind: Literal["slow_ramp"] = "slow_ramp"
    amplitude: Amplitude = math.radians(10.8)
    speed: Annotated[FiniteFloat, Field(gt=0, le=3)] = math.radians(4.0)
    reversals: Annotated[int, Field(ge=0, le=200)] = 3


class Sine(_UserRecord):
    """`cycles` of a sine about the start posture. Each joint lags `phase` rad behind the one before it."""

    kind: Literal["sine"] = "sine"
    amplitude: Amplitude = math.radians(10.8)
    period: Duration = 3.0
    cycles: Annotated[FiniteFloat, Field(gt=0, le=1000)] = 3.0
    phase: Angle = 0.0


class Multisine(_UserRecord):
    """Sum of `tones` sines between two frequencies with seeded phases, scaled to the amplitude, faded in and out."""

    kind: Literal["multisine"] = "multisine"
    amplitude: Amplitude = math.radians(7.2)
    duration: Duration = 10.0
    lowest: Annotated[FiniteFloat, Field(gt=0, le=25)] = 0.1
    highest: Annotated[FiniteFloat, Field(gt=0, le=25)] = 2.0
    tones: Annotated[int, Field(ge=1, le=100)] = 10
    seed: Annotated[int, Field(ge=0, lt=2**63)] = 1

    @model_validator(mode="after")
    def _ordered(self) -> Self:
        if self.lowest > self.highest:
            raise ValueError(f"lowest frequency {self.lowest} Hz is above the highest {self.highest} Hz")
        return self


class Cubic(_UserRecord):
    """Cubic in time through `amplitude` in `duration`, at rest at both ends."""

    kind: Literal["cubic"] = "cubic"
    amplitude: Amplitude = DEFAULT_AMPLITUDE
    duration: Duration = 1.0


class Via(_UserRecord):
    """Cubic segments through via points to the last one, at rest at both ends (section 3.7.1).

    `points` are angles (rad) from the start, one for all joints or one per joint; `times` (s) count from there, and the
    last is the end. Position, velocity and acceleration are continuous.
    """

    kind: Literal["via"] = "via"
    points: Annotated[tuple[Amplitude, ...], Field(min_length=1, max_length=1000, fail_fast=True)]
    times: Annotated[tuple[Duration, ...], Field(min_length=1, max_length=1000, fail_fast=True)]

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        if len(self.times) != len(self.points):
            raise ValueError(f"{len(self.times)} times for {len(self.points)} points")
        if any(b <= a for a, b in zip(self.times, self.times[1:], strict=False)):
            raise ValueError("times must increase strictly")
        return self


class PickAndPlace(_UserRecord):
    """Straight up by `lift` m, over to `amplitude` from the start, straight down: a 4-3-4 trajectory (section 3.7.2).

    The lift-off and set-down points are `lift` above the ends; in between joints move by polynomials of orders 4, 3 and
    4 in `pick`, `travel` and `place` s. Position, velocity and acceleration are continuous, and both ends at rest.
    """

    kind: Literal["pick_and_place"] = "pick_and_place"
    amplitude: Amplitude = DEFAULT_AMPLITUDE
    lift: Annotated[FiniteFloat, Field(gt=0, le=1)] = 0.05
    pick: Duration = 1.0
    travel: Duration = 2.0
    place: Duration = 1.0


class Path(_UserRecord):
    """A recorded or designed path: absolute angles (rad) of the experiment's joints at times (s), linear in between.

    The first point is the start, to which the arm is brought by a slow move.
    """

    kind: Literal["path"] = "path"
    times: Annotated[tuple[FiniteFloat, ...], Field(min_length=2, max_length=MOST_POINTS, fail_fast=True)]
    positions: Annotated[tuple[Row, ...], Field(min_length=2, max_length=MOST_POINTS, fail_fast=True)]
    """One row per time, one column per joint."""

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        if len(self.times) != len(self.positions):
            raise ValueError(f"{len(self.times)} times for {len(self.positions)} rows of positions")
        if self.times[0] != 0 or any(b <= a for a, b in zip(self.times, self.times[1:], strict=False)):
            raise ValueError("times must start at 0 and increase strictly")
        return self


class Pause(_UserRecord):
    """No motion for `duration` s; a part of a sequence."""

    kind: Literal["pause"] = "pause"
    duration: Duration


Simple = Annotated[
    Ramp | Step | Staircase | SlowRamp | Sine | Multisine | Cubic | Via | Pause, Field(discriminator="kind")
]


class Segment(_UserRecord):
    """One part of a sequence, on its own joints (None: on all joints of the experiment)."""

    move: Simple
    joints: tuple[JointNumber, ...] | None = None


class Sequence(_UserRecord):
    """Parts in order, each beginning where the previous one ended."""

    kind: Literal["sequence"] = "sequence"
    segments: Annotated[tuple[Segment, ...], Field(min_length=1, max_length=1000, fail_fast=True)]


Trajectory = Annotated[
    Ramp | Step | Staircase | SlowRamp | Sine | Multisine | Cubic | Via | PickAndPlace | Path | Pause | Sequence,
    Field(discriminator="kind"),
]


class PlainExperiment(_UserRecord):
    """An experiment without `feedforward`. ExperimentSpec describes its fields."""

    trajectory: Trajectory = Ramp()
    joints: Annotated[tuple[JointNumber, ...], Field(min_length=1, max_length=JOINTS)] = (1, 2, 3)
    start: dict[JointNumber, Angle] = {}
    gains: dict[JointNumber, Gain] = {}
    settle: Hold = 0.5
    hold: Hold = 2.0
    repeats: Annotated[int, Field(ge=1, le=1000)] = 1
    record: Annotated[tuple[JointNumber, ...], Field(min_length=1, max_length=JOINTS)] | None = None
    name: Annotated[str, Field(pattern=r"^[A-Za-z0-9][A-Za-z0-9_.-]{0,63}$")] | None = None
    operator: Annotated[str, Field(max_length=100)] | None = None
    notes: Annotated[str, Field(max_length=10000)] = ""

    @model_validator(mode="after")
    def _joints_agree(self) -> Self:
        if list(self.joints) != sorted(set(self.joints)):
            raise ValueError(f"joints {list(self.joints)}: must be different and ascending")
        if self.record is not None and not set(self.joints) <= set(self.record):
            raise ValueError(f"record {list(self.record)} leaves out joints that move: {list(self.joints)}")
        moves: list[tuple[object, tuple[int, ...]]] = [(self.trajectory, self.joints)]
        if isinstance(self.trajectory, Sequence):
            moves = [(segment.move, segment.joints or self.joints) for segment in self.trajectory.segments]
        for move, joints in moves:
            if not set(joints) <= set(self.joints):
                raise ValueError(f"a segment moves joints {list(joints)}, the experiment has {list(self.joints)}")
            given = move.points if isinstance(move, Via) else (getattr(move, "amplitude", None),)
            for amplitude in given:
                if isinstance(amplitude, dict) and set(amplitude) != set(joints):
                    what = "a point" if isinstance(move, Via) else "amplitude"
                    raise ValueError(f"{what} is given for joints {sorted(amplitude)}, the motion is on {list(joints)}")
        if isinstance(self.trajectory, Path) and len(self.trajectory.positions[0]) != len(self.joints):
            columns = len(self.trajectory.positions[0])
            raise ValueError(f"the path has {columns} columns for {len(self.joints)} joints")
        return self


class TrackingError(FrozenRecord):
    """Deviation of a joint from the wanted motion: root mean square and largest, rad (m on a prismatic joint)."""

    rms: Annotated[FiniteFloat, Field(ge=0)]
    largest: Annotated[FiniteFloat, Field(ge=0)]


class Feedforward(FrozenRecord):
    """Origin of a path's set points: they were computed so that the arm follows another experiment's motion.

    `asked`: that experiment. `model`, `learned_from`: ID of the model used and of the trace learned from; at least one
    is given. `expected`: predicted tracking error. `before`: tracking error without feedforward, either simulated or
    measured in that trace.
    """

    asked: PlainExperiment
    model: Annotated[str, Field(max_length=100)] | None = None
    learned_from: Annotated[str, Field(max_length=100)] | None = None
    expected: dict[JointNumber, TrackingError]
    before: dict[JointNumber, TrackingError]


class ExperimentSpec(PlainExperiment):
    """One experiment. The same model serves the command line, the service and the trace's metadata.

    `start`: angles (rad) of joints at the start of the record; joints not named go to the machine's rest posture.
    `settle`, `hold`: times (s) at rest before and after the motion, both recorded. `record`: joints to record; None for
    every joint that the line has capacity for. `feedforward`: the motion for which a path's set points were computed.
    """

    feedforward: Annotated[Feedforward | None, Field(exclude_if=lambda one: one is None)] = None

    @classmethod
    def model_validate(cls, obj: Any, **options: Any) -> Self:
        """Reads plain data. Raises a one-line SpecError that names the field and what is allowed."""
        try:
            return super().model_validate(obj, **options)
        except ValidationError as error:
            raise SpecError(_one_line(error)) from error

    @model_validator(mode="after")
    def _computed_path(self) -> Self:
        if self.feedforward is not None and not isinstance(self.trajectory, Path):
            raise ValueError(f"feedforward is for a path of computed set points, not for a {self.trajectory.kind}")
        return self

    @property
    def wanted_motion(self) -> ExperimentSpec:
        """The experiment whose motion is wanted: this one or, for computed set points, the one that they follow."""
        return self if self.feedforward is None else ExperimentSpec(**dict(self.feedforward.asked))

    @property
    def without_feedforward(self) -> PlainExperiment:
        """This experiment without its `feedforward`."""
        return PlainExperiment(**{name: getattr(self, name) for name in PlainExperiment.model_fields})


@dataclass(frozen=True)
class OfferedExperiment:
    """An experiment that a diagnosis may propose. `general`: whether it suits effects of every kind."""

    name: str
    description: str
    spec: ExperimentSpec
    general: bool = False


def parse_spec(data: object, origin: str = "experiment") -> ExperimentSpec:
    """Returns an experiment from plain data. Raises a one-line SpecError that names the field and what is allowed."""
    try:
        return ExperimentSpec.model_validate(data)
    except SpecError as error:
        raise SpecError(f"{origin}: {error}") from error


def _one_line(error: ValidationError) -> str:
    """States the field, what is allowed and what was given; angles in degrees, as people type them."""
    # For a dict of values per joint, drop pydantic's error that it is not a single float.
    relevant = [one for one in error.errors() if one["type"] != "float_type" or not isinstance(one["input"], dict)]
    first = invalid_of(relevant[0]) if relevant else first_invalid(error)
    where, value, message = [str(part) for part in first.place], first.value, first.message
    # Pydantic's names for the branches of a union mean nothing to users.
    where = [
        part
        for i, part in enumerate(where)
        if not part.startswith(("constrained-", "function-", "dict[")) and (i != 1 or where[0] != "trajectory")
    ]
    if "gains" in where[:1] and len(where) == GAIN_LOCATION_LENGTH:
        where = [f"gains of joint {where[1]}", "PID"[int(where[2])]]
    bound = next((first.bounds[key] for key in ("le", "ge") if key in first.bounds), None)
    if bound is not None and math.isclose(abs(bound), 2 * math.pi) and _fits_a_float(value):
        message = "must lie between -360° and 360°, that is ±6.283 rad"
        value = f"{value:g} rad, {math.degrees(value):g}°"
    elif not isinstance(value, str) or len(value) > LONGEST_SHOWN:
        value = shown(value)
    given = "" if isinstance(first.value, dict | BaseModel) else f" (got {value})"
    prefix = f"{'.'.join(where)}: " if where else ""
    return f"{prefix}{message}{given}"


def _fits_a_float(value: object) -> bool:
    """Whether the value can be converted to degrees; an integer may be larger than any float."""
    return isinstance(value, int | float) and abs(value) <= sys.float_info.max


def parse_joints(text: str) -> tuple[int, ...]:
    """Returns the joint numbers in `1-3`, `1,3` or `1-2,5`. Raises SpecError for any other text."""
    joints: set[int] = set()
    for part in text.split(","):
        match = re.fullmatch(r"\s*(\d{1,4})\s*(?:-\s*(\d{1,4})\s*)?", part)
        if match is None:
            raise SpecError(f"joints {text!r}: write 1-3, 1,3 or 2; joints are 1 to {JOINTS}")
        first = int(match[1])
        last = int(match[2]) if match[2] else first
        if last < first:
            raise SpecError(f"joints {text!r}: {first}-{last} runs backwards, write {last}-{first}")
        for joint in (first, last):
            if not 1 <= joint <= JOINTS:
                raise SpecError(f"joints {text!r}: there is no joint {joint}, joints are 1 to {JOINTS}")
        for joint in range(first, last + 1):
            if joint in joints:
                raise SpecError(f"joints {text!r}: joint {joint} is given twice")
            joints.add(joint)
    return tuple(sorted(joints))
