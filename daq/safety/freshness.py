"""Checks that samples are current: ticks must continue without long gaps, and the board must not restart.

The link itself notices silence: when its retries are used up it raises LinkTimeoutError.
"""

from __future__ import annotations

from dataclasses import dataclass, field

from daq.contracts.sample import SampleCount, SampleRow
from daq.safety.findings import NOTHING, Finding, Verdict, Watched
from firmware_protocol.commands import StatusFlag

LONGEST_SILENCE = 0.2
"""Longest time (s) between two samples: an assumption, ten control periods."""

SILENT_SAMPLES = 3
"""Samples that may be missing in a row on a line so slow that ten control periods hold fewer: an assumption."""


@dataclass
class Freshness:
    """Remembers the last tick."""

    watched: Watched
    every: int = 1
    """Control periods from one sample to the next, as the line allows."""
    tick: int | None = None
    count: SampleCount = field(init=False)

    def __post_init__(self) -> None:
        self.count = SampleCount(self.every)

    def check(self, row: SampleRow) -> Verdict:
        """The verdict after a sample."""
        last, self.tick = self.tick, row.tick
        if row.status & StatusFlag.RESTARTED.value or (last is not None and row.tick < last):
            line = f"the board has restarted: tick {row.tick}" + ("" if last is None else f" after {last}")
            return Verdict(trips=(line,), findings=(Finding("restart", line),))
        if last is None:
            return NOTHING
        if row.tick == last:
            return Verdict(trips=(f"stale sample: tick {row.tick} came twice",))
        if not self.count.missing(row.tick - last):
            return NOTHING
        lost = row.tick - last - self.every
        line = f"{lost} control periods between ticks {last} and {row.tick} have no sample"
        if self.every > 1:
            line = (
                f"ticks {last} and {row.tick} are {row.tick - last} control periods apart, {self.every} were asked for"
            )
        gap = (row.tick - last) * self.watched.period
        longest = max(LONGEST_SILENCE, SILENT_SAMPLES * self.every * self.watched.period)
        trips = (f"{line}; allowed are gaps up to {longest:g} s",) if gap > longest + 1e-9 else ()
        return Verdict(trips=trips, findings=(Finding("missing", line),))
