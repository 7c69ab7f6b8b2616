"""Pauses the set points while samples are too old."""

from __future__ import annotations

from dataclasses import dataclass

from daq.safety import Verdict
from daq.safety.findings import NOTHING, Finding

OLDEST_TO_ACT_ON = 0.06
"""Age (s) of a sample beyond which set points pause (an assumption: three control periods). A host that was held up
briefly catches up within that time. With older samples it would send many set points at once without seeing the arm."""
LONGEST_BEHIND = 1.0
"""Time (s) for which samples may stay too old before the run ends in a fault (an assumption)."""


def oldest_to_act_on(between: float) -> float:
    """Age (s) of a sample beyond which no action is based on it. On a slow line it is the age of two samples, which are
    `between` s apart."""
    return max(OLDEST_TO_ACT_ON, 2 * between)


@dataclass
class Lag:
    """Checks the age of each sample, on the board's clock.

    `every`: control periods between two samples. On a slow line both limits grow: an age of two samples, for at most
    ten samples.
    """

    period: float
    every: int = 1
    since: int | None = None

    def check(self, tick: int, age: float) -> Verdict:
        """Returns the verdict. `age`: delay (s) of a sample compared with the quickest ones."""
        between = self.every * self.period
        if age <= oldest_to_act_on(between):
            was, self.since = self.since, None
            if was is None:
                return NOTHING
            line = f"samples are up to date again after {(tick - was) * self.period:.2f} s: set points continue"
            return Verdict(findings=(Finding("resume", line),))
        line = f"the sample of tick {tick} came {age * 1e3:.0f} ms late"
        findings: tuple[Finding, ...] = ()
        if self.since is None:
            self.since = tick
            findings = (Finding("pause", f"{line}, set points wait for fresh ones"),)
        behind = (tick - self.since) * self.period
        if behind <= max(LONGEST_BEHIND, 10 * between):
            return Verdict(hold=True, findings=findings)
        trip = (
            f"samples came up to {age * 1e3:.0f} ms late for {behind:.1f} s: this computer is too busy, or the line "
            "too slow; end other programs, then reset the arm"
        )
        return Verdict(hold=True, trips=(trip,), findings=findings)
