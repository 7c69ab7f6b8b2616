"""Replies of other dialects, with more room than the frames of PROTOCOL.md have: counts and powers of 32 bits, and any
number of joints up to the driver's six.

They have no frame: they go from a dialect to the driver, whose own are their bases.
"""

from __future__ import annotations

from dataclasses import dataclass

from firmware_protocol.joints import JointReading
from firmware_protocol.message import check_range
from firmware_protocol.replies import Gains, Stopped

_LOWEST, _HIGHEST = -0x80000000, 0x7FFFFFFF
_GAIN_HIGHEST = 0xFFFF


@dataclass(frozen=True)
class WideReading(JointReading):
    """Set point in the line's own steps, position and error in its counts (where both count alike, error is set point −
    position), power in steps of the controller's output (`controller.drive_resolution` of the machine file each)."""

    def __post_init__(self) -> None:
        for name in ("set_point", "position", "error", "power"):
            check_range(name, getattr(self, name), _LOWEST, _HIGHEST)


@dataclass(frozen=True)
class WideStopped(Stopped):
    """Set points at which a stop holds the joints 1, 2 …, in the line's own steps. A joint moved by hand may be
    outside its range."""

    def __post_init__(self) -> None:
        check_range("tick", self.tick, 0, 0xFFFFFFFF)


@dataclass(frozen=True)
class WideGains(Gains):
    """(P, I, D) of the joints 1, 2 … in the controller's own numbers: 0–65535."""

    def __post_init__(self) -> None:
        for gains in self.gains:
            for name, value in zip("PID", gains, strict=True):
                check_range(f"gain {name}", value, 0, _GAIN_HIGHEST)
