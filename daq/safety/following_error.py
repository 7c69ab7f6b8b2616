"""The following error: set points pause while it is too large, and a pause that lasts is a fault (section 6.5)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from daq.contracts.sample import SampleRow
from daq.safety.findings import NOTHING, Finding, Verdict, Watched


@dataclass
class FollowingError:
    """Two rules with one limit. A positional error outside the limit holds the set points; and no set point may be
    further from the measured position than the limit, so that an arm whose host or cable dies stops within it. Time is
    the board's. A hold that lasts longer than `limits.following_error_time` is a fault."""

    watched: Watched
    held_since: int | None = None

    def check(self, row: SampleRow, planned: Mapping[int, int]) -> Verdict:
        """`planned` are the postures (by joint) that would be sent next."""
        limit = self.watched.limits.following_error_counts
        if limit is None:
            return NOTHING
        reason = self._outside(row, limit) or self._ahead(row, planned, limit)
        if reason is None:
            was_held, self.held_since = self.held_since, None
            if was_held is None:
                return NOTHING
            waited = (row.tick - was_held) * self.watched.period
            return Verdict(findings=(Finding("resume", f"set points go on after {waited:.2f} s"),))
        findings: tuple[Finding, ...] = ()
        if self.held_since is None:
            self.held_since = row.tick
            findings = (reason,)
        held = (row.tick - self.held_since) * self.watched.period
        longest = self.watched.limits.following_error_time
        if longest is not None and held > longest:
            line = f"{reason.message}; it lasted {held:.2f} s, allowed are {longest:g} s"
            return Verdict(hold=True, trips=(line,), findings=findings)
        return Verdict(hold=True, findings=findings)

    def _outside(self, row: SampleRow, limit: int) -> Finding | None:
        for joint, counts in zip(self.watched.joints, self.watched.counts(row.error), strict=True):
            if abs(round(counts)) > limit:
                line = f"joint {joint}: positional error of {counts:.0f} ADC counts, set points pause outside ±{limit}"
                return Finding("pause", line, joint)
        return None

    def _ahead(self, row: SampleRow, planned: Mapping[int, int], limit: int) -> Finding | None:
        for joint, own, position in zip(self.watched.joints, self.watched.calibrations, row.position, strict=True):
            if joint not in planned:
                continue
            counts = (own.posture_to_rad(planned[joint]) - position) / own.rad_per_count
            if abs(counts) > limit:
                line = (
                    f"joint {joint}: next set point is {counts:.0f} ADC counts from the arm, "
                    f"it waits until the arm is within ±{limit}"
                )
                return Finding("pause", line, joint)
        return None
