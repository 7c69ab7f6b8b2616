"""One sample on its way from the controller to a trace, a screen or a guard."""

from __future__ import annotations

import math
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class SampleRow:
    """One control period of some joints, in SI units, one value per joint, in the order of the trace's joints.

    `time` is tick · period, in s from the record's first tick: the board's own time. `host_time` is the host's
    monotonic clock (s) when the sample arrived. `set_point` is what the controller took in this period, not what was
    sent, and `taken` the number of the first period that used it, 0 where that is not known. `status` holds the board's
    flags (`firmware_protocol.commands.StatusFlag`). `velocity` is empty on a rig that does not measure it, such as the
    MA2000.
    """

    tick: int
    time: float
    host_time: float
    set_point: tuple[float, ...]
    position: tuple[float, ...]
    error: tuple[float, ...]
    drive: tuple[float, ...]
    power_raw: tuple[int, ...]
    status: int = 0
    velocity: tuple[float, ...] = ()
    taken: int = 0


class SampleCount:
    """Counts the samples that are missing where one is asked for in every `every` control periods.

    A sample that is less than half its distance late is late, and not missing: its tick says when it was taken. But
    lateness adds up: where every sample is a third of the distance late, every fourth one is missing. A sample that
    comes early makes up for half a distance at most.
    """

    def __init__(self, every: int) -> None:
        self.every = every
        self._late = 0.0
        """Periods by which the newest sample is beside its place; negative: before it."""

    def missing(self, step: int) -> int:
        """How many samples are missing between the sample before and one that is `step` periods newer."""
        late = max(self._late + step - self.every, -self.every / 2)
        lost = max(0, math.floor(late / self.every + 0.5))
        self._late = late - lost * self.every
        return lost
