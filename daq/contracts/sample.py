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


def samples_missing(step: int, every: int) -> int:
    """How many samples would have had their place between two that are `step` periods apart, when one is asked for in
    every `every` periods: step / every, rounded, less one. A sample that is less than half its distance late is late,
    and not missing: its tick says when it was taken. 0 where `step` is not positive."""
    return max(0, (2 * step + every) // (2 * every) - 1)
