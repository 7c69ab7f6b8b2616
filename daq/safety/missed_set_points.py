"""Set points that the controller did not take because the host had the memory (section 6.3 of the source)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from daq.contracts.sample import SampleRow
from daq.safety.findings import NOTHING, Finding, Verdict, Watched
from firmware_protocol.commands import StatusFlag

LONGEST_RUN = 10
"""Most control periods in a row in which the controller may miss its set points: an assumption, 0.2 s."""


@dataclass
class MissedSetPoints:
    """Counts missed set points. One is harmless, since set points are absolute; a run of them means a loss of
    control."""

    watched: Watched
    every: int = 1
    """Control periods from one sample to the next: on a slow line a run lasts as long, but is two samples at least."""
    missed: int = 0
    run: int = 0

    def check(self, row: SampleRow, expected: Mapping[int, int] | None) -> Verdict:
        """`expected` are the postures (by joint) that this period should have taken; None when unknown."""
        line = self._difference(row, expected or {})
        if row.status & StatusFlag.SET_POINT_MISSED.value:
            line = line or f"tick {row.tick}: the controller wanted the memory while the host had it"
        if line is None:
            self.run = 0
            return NOTHING
        self.missed += 1
        self.run += 1
        allowed = max(2, LONGEST_RUN // self.every)
        trips = (f"{self.run} set points missed in a row, allowed are {allowed}",) if self.run > allowed else ()
        return Verdict(trips=trips, findings=(Finding("missed_set_point", line),))

    def _difference(self, row: SampleRow, expected: Mapping[int, int]) -> str | None:
        for joint, own, taken in zip(self.watched.joints, self.watched.calibrations, row.set_point, strict=True):
            if joint not in expected:
                continue
            posture = round((taken - own.angle_at_zero_rad) / own.rad_per_posture_unit)
            if posture != expected[joint]:
                return f"joint {joint}: tick {row.tick} took posture {posture}, sent was {expected[joint]}"
        return None
