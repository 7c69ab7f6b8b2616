"""One sample, as passed from the controller to traces, views and guards."""

from __future__ import annotations

import math
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class SampleRow:
    """One control period of some joints in SI units: one value per joint, in the order of the trace's joints.

    `time`: tick · period, in s from the record's first tick, by the board's clock. `host_time`: the host's monotonic
    clock (s) at the sample's arrival. `set_point`: the one that the controller used in this period, not the one that
    was sent. `taken`: number of the first period that used it, 0 if unknown. `status`: the board's flags
    (`firmware_protocol.commands.StatusFlag`). `velocity`: empty on a machine that does not measure it, such as the
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
    """Counts missing samples if one sample is requested per `every` control periods.

    A sample that is late by less than half this distance is not missing: its tick shows when it was taken. But delays
    add up: if every sample is a third of the distance late, every fourth one is missing. A sample that comes early
    compensates for at most half a distance.
    """

    def __init__(self, every: int) -> None:
        self.every = every
        self._late = 0.0
        """Periods by which the newest sample is late; negative: early."""

    def missing(self, step: int) -> int:
        """Returns how many samples are missing between the previous sample and one that is `step` periods newer."""
        late = max(self._late + step - self.every, -self.every / 2)
        lost = max(0, math.floor(late / self.every + 0.5))
        self._late = late - lost * self.every
        return lost
