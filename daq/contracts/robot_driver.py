"""Robots driven by Python objects instead of bytes on a line: what such a driver offers, and what safety needs of it.

A plug-in names drivers by the scheme of their URLs (`Plugin.drivers`). docs/your-robot.md has the order of calls.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, Protocol

from daq.contracts import exit_codes
from daq.contracts.errors import DaqError
from firmware_protocol.memory_map import JOINTS


class DriverError(DaqError):
    """A driver cannot do what was asked, in one line. A passing fault of a read or write is tried again."""

    exit_code = exit_codes.NOT_REACHED


class UnfitRobotError(DriverError):
    """A robot lacks what safety needs, so it is not driven."""

    exit_code = exit_codes.WRONG_INPUT


@dataclass(frozen=True)
class DriverFacts:
    """Properties of a robot.

    joints:    names of the driven joints, in the order of the machine file
    counts:    steps of positions and set points over the machine file's sensor range, from 0
    range_rad: that range (rad), and `low_rad` its lower end
    measured:  joints with a measured position
    fresh:     how the age of a reading is known: it is `stamped`, or measured `on request`
    holds:     whether the joints keep their last set points by themselves when nobody writes
    period_s:  time (s) from one reading to the next
    call_s:    usual time (s) of one read or write
    largest_step_rad: largest distance (rad) from one set point to the next
    """

    joints: tuple[str, ...]
    counts: int
    range_rad: float
    low_rad: float
    measured: frozenset[str]
    fresh: Literal["stamped", "on request"] | None
    holds: bool
    simulated: bool = False
    period_s: float = 0.020
    call_s: float = 0.008
    largest_step_rad: float = 0.25


@dataclass(frozen=True)
class Positions:
    """Measured positions (rad) of the joints; `time_s` on this computer's monotonic clock, if they are stamped."""

    rad: tuple[float, ...]
    time_s: float | None = None


class RobotDriver(Protocol):
    """One robot. One thread calls it, for everything. Every method may raise DriverError."""

    @property
    def facts(self) -> DriverFacts:
        """Known without a connection."""
        ...

    def connect(self) -> None:
        """Opens the connection. Moves nothing, and switches no drive on or off."""
        ...

    def read(self) -> Positions:
        """Measures the positions."""
        ...

    def write(self, rad: Sequence[float]) -> Sequence[float]:
        """Writes the set points (rad) of all joints. Returns those that the robot accepted."""
        ...

    def switch_on(self) -> None:
        """Makes all joints hold. Called right after the measured positions were written as set points."""
        ...

    def stop(self, rad: Sequence[float]) -> None:
        """Stops all joints, which were just measured at `rad`; they hold. May write these as set points."""
        ...

    def disconnect(self) -> None:
        """Ends the connection. The joints go on holding."""
        ...


def require_fit(name: str, facts: DriverFacts) -> None:
    """Raises UnfitRobotError for a robot that cannot be stopped, held or watched as safety needs."""
    unmeasured = [joint for joint in facts.joints if joint not in facts.measured]
    why = ""
    if not 1 <= len(facts.joints) <= JOINTS:
        why = f"it has {len(facts.joints)} joints, 1 to {JOINTS} are driven"
    elif unmeasured:
        why = f"{', '.join(unmeasured)}: no position is measured, so a stop could not be confirmed"
    elif not facts.holds:
        why = "it does not hold its last set points by itself, so it would not be safe when this program falls silent"
    elif facts.fresh is None:
        why = "its readings have no time stamps and are not measured on request, so old ones would pass for new"
    if why:
        raise UnfitRobotError(f"{name} is not driven: {why}")
