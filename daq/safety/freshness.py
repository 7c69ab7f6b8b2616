"""Is what we see the arm as it is now? Ticks must go on, the board must not restart, the link must not fall silent."""

from __future__ import annotations

from dataclasses import dataclass

from daq.contracts.sample import SampleRow
from daq.safety.findings import NOTHING, Finding, Verdict, Watched
from firmware_protocol.commands import StatusFlag

LONGEST_SILENCE = 0.2
"""Time (s) without a fresh sample after which the link counts as lost: an assumption, ten control periods."""


@dataclass
class Freshness:
    """Remembers the last tick and when it came."""

    watched: Watched
    tick: int | None = None
    host_time: float | None = None

    def check(self, row: SampleRow) -> Verdict:
        """A sample has come."""
        last, self.tick, self.host_time = self.tick, row.tick, row.host_time
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

    def silent(self, now: float) -> Verdict:
        """No sample has come; `now` (s) is the clock of `SampleRow.host_time`."""
        if self.host_time is None:
            self.host_time = now
        silence = now - self.host_time
        if silence <= LONGEST_SILENCE:
            return Verdict(hold=True)
        line = f"no fresh sample for {silence:.2f} s, allowed are {LONGEST_SILENCE:g} s"
        return Verdict(hold=True, trips=(line,), findings=(Finding("link_lost", line),))
