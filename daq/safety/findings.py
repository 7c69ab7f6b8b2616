"""What guards find in one control period, and what they need to know of the machine."""

from __future__ import annotations

from dataclasses import dataclass

from daq.contracts.limits import Limits
from daq.contracts.machine import Machine
from daq.contracts.trace import EventKind
from daq.trajectories.set_points import control_period
from firmware_protocol.units import JointCalibration


@dataclass(frozen=True)
class Finding:
    """Something worth an event in the trace."""

    kind: EventKind
    message: str
    joint: int | None = None


@dataclass(frozen=True)
class Verdict:
    """The decision after one control period.

    hold:     set points stay as they are and the plan's time stands still
    stop:     somebody has stopped the arm on the board; None when nobody has
    trips:    reasons for a fault: freeze now
    findings: events for the trace
    """

    hold: bool = False
    stop: str | None = None
    trips: tuple[str, ...] = ()
    findings: tuple[Finding, ...] = ()

    def __or__(self, other: Verdict) -> Verdict:
        # Nearly every verdict finds nothing.
        if other is NOTHING:
            return self
        if self is NOTHING:
            return other
        return Verdict(
            self.hold or other.hold, self.stop or other.stop, self.trips + other.trips, self.findings + other.findings
        )


NOTHING = Verdict()
"""Go on."""


@dataclass(frozen=True)
class Watched:
    """The joints of each sample, in its order, with the calibrations that turn angles into counts and posture units."""

    joints: tuple[int, ...]
    calibrations: tuple[JointCalibration, ...]
    period: float
    limits: Limits

    @classmethod
    def of(cls, machine: Machine, limits: Limits, joints: tuple[int, ...]) -> Watched:
        """Raises SpecError for joints that the machine does not have, or that have no sensor."""
        calibrations = tuple(machine.calibration(joint) for joint in joints)
        return cls(joints, calibrations, control_period(machine), limits)

    def counts(self, angles: tuple[float, ...]) -> tuple[float, ...]:
        """ADC counts, with the joint's sign, of differences of angle (rad) in the sample's order."""
        return tuple(angle / own.rad_per_count for angle, own in zip(angles, self.calibrations, strict=True))
