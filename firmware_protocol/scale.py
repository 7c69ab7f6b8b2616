"""What a line protocol can say of its machine: how many joints, in which steps, how often, in how many bytes."""

from __future__ import annotations

from dataclasses import dataclass

from firmware_protocol.memory_map import JOINTS
from firmware_protocol.units import ADC_COUNTS, POSTURE_UNITS


@dataclass(frozen=True)
class LineScale:
    """The defaults are those of the MA2000.

    joints:          number of joints behind the line
    set_point_units: units of a set point over a joint's range, 0 the lowest
    position_counts: counts of a position over a joint's range, 0 the lowest
    every:           control periods from one sample to the next on a line that is quick enough
    turn_bytes:      bytes that pass for one sample of all joints and their set points, both ways together; None where
                     they are those of PROTOCOL.md, which depend on the joints asked for
    greeting_bytes:  bytes of the answer to a greeting, where it is longer than a turn
    half_duplex:     both sides share one wire, so that a request must not be written while an answer may be coming
    """

    joints: int = JOINTS
    set_point_units: int = POSTURE_UNITS
    position_counts: int = ADC_COUNTS
    every: int = 1
    turn_bytes: int | None = None
    greeting_bytes: int = 0
    half_duplex: bool = False
