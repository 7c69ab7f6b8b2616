"""Moving the arm by hand and by program, as the original's teach pendant did."""

from __future__ import annotations

from typing import Annotated

from pydantic import AwareDatetime, Field

from daq.contracts.experiment import JointNumber
from daq.contracts.service.base import Wire
from daq.contracts.service.robot import Activity

Velocity = Annotated[float, Field(ge=-3, le=3)]
Angle = Annotated[float, Field(ge=-7, le=7)]


class JogRequest(Wire):
    """Velocities (rad/s) of joints, applied for at most 0.3 s: the client repeats the request while the key is held.
    No velocities: hold."""

    velocities: dict[JointNumber, Velocity]


class StepRequest(Wire):
    """One off-line step to absolute angles (`to`) or by relative ones (`by`), in rad; give one of the two. `speed` is
    that of the fastest joint, in rad/s."""

    to: dict[JointNumber, Angle] | None = None
    by: dict[JointNumber, Angle] | None = None
    speed: Annotated[float, Field(gt=0, le=0.35)] = 0.25


class LeadRequest(Wire):
    """Joints to be led by hand. They lose their drive and sink: hold the arm."""

    joints: Annotated[tuple[JointNumber, ...], Field(min_length=1)] = (1, 2, 3)


class TaughtPath(Wire):
    """Measured angles (rad), one row per control period, one column per joint; times (s) from the first row. An
    experiment with this as its `path` plays it back."""

    joints: tuple[int, ...]
    times: tuple[float, ...]
    positions: tuple[tuple[float, ...], ...]


class TeachingLine(Wire):
    """A line for the operator who teaches, such as a refused joint, or the beginning of an instruction."""

    number: int
    at: AwareDatetime
    text: str


class TeachingStatus(Wire):
    """The teaching activity under way, and how the last one ended."""

    activity: Activity
    lines: tuple[TeachingLine, ...] = ()
    """The newest lines, the oldest of them first."""
    result: str = ""
    """How the last teaching ended; empty while one goes on, or before the first."""
    problem: str = ""
    """Why the last teaching ended early."""
    path: TaughtPath | None = None
    """The path that was last led by hand."""


class ProgramEntry(Wire):
    """A taught program that the service keeps. `revision` grows with every change; `instructions` is their number."""

    name: str
    robot: str
    revision: int
    instructions: int
    changed: AwareDatetime
    changed_by: str


class CalibrationRequest(Wire):
    """Joints whose actual proportional gain is measured by small steps at several postures (section 6.5)."""

    joints: Annotated[tuple[JointNumber, ...], Field(min_length=1)] = (1, 2, 3)


class MeasuredGain(Wire):
    """The actual proportional gain of one joint, in DAC counts per ADC count of error, and in V/rad at the motor; or
    the reason why the trace does not determine it. Gains between `lowest` and `highest` agree with every sample."""

    joint: int
    gain: float | None = None
    standard_error: float | None = None
    lowest: float | None = None
    highest: float | None = None
    volts_per_rad: float | None = None
    reason: str = ""
