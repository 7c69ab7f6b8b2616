"""One sample on its way from the controller to a trace, a screen or a guard."""

from __future__ import annotations

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
