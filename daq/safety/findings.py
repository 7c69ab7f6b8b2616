"""Results of the guards in one control period, and the machine data that they need."""

from __future__ import annotations

from dataclasses import dataclass

from daq.contracts.limits import Limits
from daq.contracts.machine import Machine
from daq.contracts.trace import EventKind
from daq.trajectories.set_points import control_period
from firmware_protocol.units import JointCalibration


@dataclass(frozen=True)
class Finding:
    """A finding that becomes an event in the trace."""

    kind: EventKind
    message: str
    joint: int | None = None


@dataclass(frozen=True)
class Verdict:
    """The decision after one control period.

    hold:     set points stay as they are and the plan's time stands still
    stop:     who or what stopped the arm on the board; None if it is not stopped
    trips:    reasons for a fault: freeze now
    findings: events for the trace
    """

    hold: bool = False
    stop: str | None = None
    trips: tuple[str, ...] = ()
    findings: tuple[Finding, ...] = ()

    def __or__(self, other: Verdict) -> Verdict:
        # Fast path: nearly every verdict is empty.
        if other is NOTHING:
            return self
        if self is NOTHING:
            return other
        return Verdict(
            self.hold or other.hold, self.stop or other.stop, self.trips + other.trips, self.findings + other.findings
        )


NOTHING = Verdict()
"""Continue."""


@dataclass(frozen=True)
class Watched:
    """The joints of each sample, in order, with the calibrations from angles to counts and posture units."""

    machine: Machine
    joints: tuple[int, ...]
    calibrations: tuple[JointCalibration, ...]
    period: float
    limits: Limits

    @classmethod
    def of(cls, machine: Machine, limits: Limits, joints: tuple[int, ...]) -> Watched:
        """Raises SpecError for joints that the machine lacks, or that have no sensor."""
        calibrations = tuple(machine.calibration(joint) for joint in joints)
        return cls(machine, joints, calibrations, control_period(machine), limits)

    def counts(self, angles: tuple[float, ...]) -> tuple[float, ...]:
        """Converts angle differences (rad, in the sample's order) to ADC counts with the sign of the joint."""
        return tuple(angle / own.rad_per_count for angle, own in zip(angles, self.calibrations, strict=True))
