"""Replies of other dialects with wider values than the frames of PROTOCOL.md: counts and powers of 32 bits, and any
number of joints up to the driver's six.

They have no frame: they are passed from a dialect to the driver as subclasses of its own replies.
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
    """Set point in the line's own steps, position and error in its counts, power in steps of the controller's output
    (both by the machine file). If set points and positions have the same steps, error is set point − position."""

    def __post_init__(self) -> None:
        for name in ("set_point", "position", "error", "power"):
            check_range(name, getattr(self, name), _LOWEST, _HIGHEST)


@dataclass(frozen=True)
class WideStopped(Stopped):
    """Set points at which a stop holds the joints 1, 2 …, in the line's own steps. A joint moved by hand may be outside
    its range."""

    def __post_init__(self) -> None:
        check_range("tick", self.tick, 0, 0xFFFFFFFF)


@dataclass(frozen=True)
class WideGains(Gains):
    """(P, I, D) of the joints 1, 2 … in the controller's own units: 0–65535."""

    def __post_init__(self) -> None:
        for gains in self.gains:
            for name, value in zip("PID", gains, strict=True):
                check_range(f"gain {name}", value, 0, _GAIN_HIGHEST)
