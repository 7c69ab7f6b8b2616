"""One consistent control period of the board, identified by its tick."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from firmware_protocol.commands import StatusFlag
from firmware_protocol.joints import JointReading

Consistency = Literal["sample", "double-read"]


@dataclass(frozen=True, slots=True)
class BoardSnapshot:
    """One control period, consistent over its joints.

    `host_time`: clock (s) at its arrival; `tick_time`: estimated clock (s) of its tick. With "double-read", the host
    estimates the tick, and the set points are computed from position and error.
    """

    tick: int
    host_time: float
    tick_time: float
    joints: tuple[tuple[int, JointReading], ...]
    """(joint, reading), joints ascending. Set point in posture units, position and error in ADC counts, power in
    DAC counts."""
    flags: StatusFlag
    consistent_by: Consistency
    missing_before: int = 0
    """Number of requested samples that are missing between the previous sample and this one."""
    set_points_missed: bool = False
    """The controller did not use the set points that were in its memory when the period began."""
    taken: int | None = None
    """The first period that used these set points, as confirmed by the bridge; None if unknown."""

    @property
    def tick_is_estimate(self) -> bool:
        """Whether the tick comes from the host's clock and not from the board."""
        return self.consistent_by == "double-read"

    @property
    def jitter(self) -> float:
        """Delay (s) of this sample compared with the quickest ones."""
        return self.host_time - self.tick_time

    @property
    def positions(self) -> dict[int, int]:
        """Joint → position in ADC counts."""
        return {joint: reading.position for joint, reading in self.joints}

    @property
    def set_points(self) -> dict[int, int]:
        """Joint → set point in posture units that the controller used."""
        return {joint: reading.set_point for joint, reading in self.joints}

    def __getitem__(self, joint: int) -> JointReading:
        """The reading of a joint (from 1). Raises KeyError if it was not sampled."""
        for number, reading in self.joints:
            if number == joint:
                return reading
        raise KeyError(joint)
