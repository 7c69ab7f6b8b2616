"""A plan: the set points of every joint at every control period."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from daq.contracts.errors import SpecError
from daq.contracts.joint_text import position_text
from daq.contracts.machine import Machine, NoController
from daq.contracts.trace import Floats, Integers

Booleans = NDArray[np.bool_]
MarkKind = Literal["start", "ramp_start", "ramp_end", "reversal", "waypoint", "end"]


@dataclass(frozen=True)
class Mark:
    """A mark that becomes an event in the trace, at set point `index`. `joint` is None if it concerns all joints."""

    index: int
    kind: MarkKind
    message: str
    joint: int | None = None


@dataclass(frozen=True)
class JointPreview:
    """Motion of one joint: angles in rad, speed in rad/s between set points; intended jumps are left out."""

    joint: int
    moves: bool
    start: float
    end: float
    lowest: float
    highest: float
    top_speed: float
    largest_step: float


@dataclass(frozen=True)
class PlanPreview:
    """Key figures of a plan, for a check before anything moves."""

    duration: float
    period: float
    set_points: int
    joints: tuple[JointPreview, ...]
    marks: tuple[tuple[float, str, str], ...]
    """Marks as (time in s, kind, message)."""

    def as_data(self) -> dict[str, object]:
        """Plain data for JSON."""
        return asdict(self)


@dataclass(frozen=True, eq=False)
class Plan:
    """Set points of all joints of a machine, one row per control period; the first row is the arm's present posture.

    period:   s
    moving:   joints (from 1) that the plan moves; the others keep their posture
    angles:   (n, joints) rad, as planned
    postures: (n, joints) posture units to be sent; not clipped, so that checks can find values outside 0–999
    jumps:    (n,) True if a set point jumps intentionally (step, staircase); its size is checked, not its speed
    """

    period: float
    moving: tuple[int, ...]
    angles: Floats
    postures: Integers
    jumps: Booleans
    marks: tuple[Mark, ...] = ()

    def __len__(self) -> int:
        return len(self.angles)

    @property
    def duration(self) -> float:
        """Time from the first set point to the last, in s."""
        return (len(self) - 1) * self.period

    @property
    def time(self) -> Floats:
        """(n,) s: time of each set point."""
        return np.arange(len(self), dtype=np.float64) * self.period

    def sent_at(self, index: int) -> dict[int, int]:
        """Joint → posture units of the moving joints at set point `index`. Made when it is due: those of all periods at
        once would take more memory than the plan."""
        row = self.postures[index].tolist()
        return {joint: row[joint - 1] for joint in self.moving}

    def marks_at(self, index: int) -> tuple[Mark, ...]:
        """Marks of set point `index`."""
        return tuple(mark for mark in self.marks if mark.index == index)

    def preview(self) -> PlanPreview:
        """Key figures of the plan."""
        change = np.abs(np.diff(self.angles, axis=0))
        smooth = np.where(self.jumps[1:, None], 0.0, change)
        steps = np.where(self.jumps[1:, None], change, 0.0)
        joints = tuple(
            JointPreview(
                joint=column + 1,
                moves=column + 1 in self.moving,
                start=float(angle[0]),
                end=float(angle[-1]),
                lowest=float(angle.min()),
                highest=float(angle.max()),
                top_speed=float(smooth[:, column].max(initial=0.0)) / self.period,
                largest_step=float(steps[:, column].max(initial=0.0)),
            )
            for column, angle in enumerate(self.angles.T)
        )
        marks = tuple((mark.index * self.period, mark.kind, mark.message) for mark in self.marks)
        return PlanPreview(self.duration, self.period, len(self), joints, marks)


def make_plan(
    machine: Machine,
    moving: Sequence[int],
    angles: Floats,
    jumps: Booleans | None = None,
    marks: tuple[Mark, ...] = (),
) -> Plan:
    """Returns a plan from angles (n, joints) in rad. Raises SpecError if they are not finite or do not fit the
    machine."""
    if angles.ndim != 2 or angles.shape[1] != len(machine.joints) or not len(angles):
        raise SpecError(f"plan: angles of shape {angles.shape}, expected (n, {len(machine.joints)})")
    if not np.isfinite(angles).all():
        row, column = (int(i) for i in np.argwhere(~np.isfinite(angles))[0])
        raise SpecError(f"plan: joint {column + 1}, set point {row}: {angles[row, column]} rad: must be finite")
    postures = np.stack([postures_of(machine, joint + 1, column) for joint, column in enumerate(angles.T)], axis=1)
    if jumps is None:
        jumps = np.zeros(len(angles), dtype=np.bool_)
    return Plan(control_period(machine), tuple(moving), angles, postures, jumps, marks)


def control_period(machine: Machine) -> float:
    """Control period (s). Raises SpecError for a machine without a controller, which accepts no set points."""
    if isinstance(machine.controller, NoController):
        raise SpecError(f"machine {machine.name}: it has no controller, so it cannot be given set points")
    period = machine.controller.period.value
    if period <= 0:
        raise SpecError(f"machine {machine.name}: controller.period is {period} s, must be above 0")
    return period


def postures_of(machine: Machine, joint: int, angles: Floats) -> Integers:
    """Posture units of joint `joint` for angles (n,) rad, rounded half up as on the wire, without its range check."""
    calibration = machine.calibration(joint)
    units = (angles - calibration.angle_at_zero_rad) / calibration.rad_per_posture_unit
    return np.floor(units + 0.5).astype(np.int64)


def representable_angles(machine: Machine, angles: Sequence[float]) -> Floats:
    """Angles (rad) of the postures nearest to `angles`, one per joint, which set points can represent.

    A reading in the last fraction of the range counts as the highest posture, as on the wire. Raises SpecError for a
    wrong number of joints, an angle that is not finite or one outside the sensor's range.
    """
    if len(angles) != len(machine.joints):
        raise SpecError(f"start: {len(angles)} angles, {machine.name} has {len(machine.joints)} joints")
    result = np.empty(len(angles))
    for column, angle in enumerate(angles):
        calibration = machine.calibration(column + 1)
        if not math.isfinite(angle):
            raise SpecError(f"joint {column + 1}: start of {angle} rad: must be finite")
        posture = int(postures_of(machine, column + 1, np.array([angle]))[0])
        if posture == calibration.posture_units:
            posture -= 1
        if not 0 <= posture < calibration.posture_units:
            highest = calibration.posture_units - 1
            low, high = sorted((calibration.posture_to_rad(0), calibration.posture_to_rad(highest)))
            first, last, asked = (position_text(machine, column + 1, one) for one in (low, high, angle))
            raise SpecError(f"joint {column + 1}: start of {asked} is outside its range of {first} to {last}")
        result[column] = calibration.posture_to_rad(posture)
    return result
