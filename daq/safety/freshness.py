"""Checks that samples are current: ticks must continue without long gaps, and the board must not restart.

The link itself notices silence: when its retries are used up it raises LinkTimeoutError.
"""

from __future__ import annotations

from dataclasses import dataclass

from daq.contracts.sample import SampleRow
from daq.safety.findings import NOTHING, Finding, Verdict, Watched
from firmware_protocol.commands import StatusFlag

LONGEST_SILENCE = 0.2
"""Longest time (s) between two samples: an assumption, ten control periods."""


@dataclass
class Freshness:
    """Remembers the last tick."""

    watched: Watched
    tick: int | None = None

    def check(self, row: SampleRow) -> Verdict:
        """The verdict after a sample."""
        last, self.tick = self.tick, row.tick
        if row.status & StatusFlag.RESTARTED.value or (last is not None and row.tick < last):
            line = f"the board has restarted: tick {row.tick}" + ("" if last is None else f" after {last}")
            return Verdict(trips=(line,), findings=(Finding("restart", line),))
        if last is None or row.tick == last + 1:
            return NOTHING
        if row.tick == last:
            return Verdict(trips=(f"stale sample: tick {row.tick} came twice",))
        lost = row.tick - last - 1
        line = f"{lost} control periods between ticks {last} and {row.tick} have no sample"
        gap = (row.tick - last) * self.watched.period
        trips = (f"{line}; allowed are gaps up to {LONGEST_SILENCE:g} s",) if gap > LONGEST_SILENCE else ()
        return Verdict(trips=trips, findings=(Finding("missing", line),))
