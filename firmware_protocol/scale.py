"""Properties of the machine on a line: number of joints, step sizes, sampling period, bytes per exchange."""

from __future__ import annotations

from dataclasses import dataclass

from firmware_protocol.memory_map import JOINTS
from firmware_protocol.units import ADC_COUNTS, POSTURE_UNITS


@dataclass(frozen=True)
class LineScale:
    """The defaults are those of the MA2000.

    joints:          number of joints on the line
    set_point_units: units of a set point over a joint's range, from 0
    position_counts: counts of a position over a joint's range, from 0
    every:           control periods from one sample to the next on a fast enough line
    turn_bytes:      bytes per sample of all joints with their set points, both directions together; None for those of
                     PROTOCOL.md, which depend on the joints
    greeting_bytes:  bytes of the answer to a greeting, if it is longer than an exchange
    measures_drive:  positions come with the controllers' outputs
    half_duplex:     both sides share one wire, so a request must not be written while an answer may be coming
    """

    joints: int = JOINTS
    set_point_units: int = POSTURE_UNITS
    position_counts: int = ADC_COUNTS
    every: int = 1
    turn_bytes: int | None = None
    greeting_bytes: int = 0
    half_duplex: bool = False
    measures_drive: bool = True
