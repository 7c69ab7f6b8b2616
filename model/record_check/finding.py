"""Findings of the check of a record, as data with words."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Literal

from daq.contracts.frozen import FrozenRecord

Consequence = Literal["fatal", "doubt", "note"]
"""fatal: nothing can be computed. doubt: the answer may be due to a fault of the record. note: for information."""
FindingKind = Literal[
    "bursts",
    "columns-swapped",
    "drive-late",
    "drive-scale",
    "drive-sign",
    "drive-zero",
    "gap",
    "gravity-magnitude",
    "gravity-reversed",
    "jump",
    "motor-constants",
    "no-sensor",
    "position-unit",
    "saturated",
    "short",
    "spikes",
    "stuck",
    "time-scale",
    "units-differ",
    "velocity-differs",
    "wraps",
]


class RecordFinding(FrozenRecord):
    """One impossible or noteworthy value of a record, or of its machine file.

    Args:
        record: name of the record; empty if the finding concerns the machine file. joint: from 1; None: all.
        times: s of the record's own clock, the first of `count`.
        value, allowed: measured value, and the largest (or the) expected one, in `unit`.
        says, advice: one sentence each.
    """

    kind: FindingKind
    consequence: Consequence
    record: str = ""
    joint: int | None = None
    times: tuple[float, ...] = ()
    count: int = 0
    value: float | None = None
    allowed: float | None = None
    unit: str = ""
    says: str
    advice: str = ""

    @property
    def line(self) -> str:
        """Returns the finding as one line, with its place."""
        place = "" if self.joint is None else f"joint {self.joint}: "
        record = f"{self.record}: " if self.record else ""
        advice = f" {self.advice}" if self.advice else ""
        return f"{record}{place}{self.says}{advice}"


def doubts_in(findings: Iterable[RecordFinding]) -> tuple[RecordFinding, ...]:
    """Returns the findings due to which an answer may show a fault of the record."""
    return tuple(f for f in findings if f.consequence != "note")


def doubts_headline(findings: Sequence[RecordFinding]) -> str:
    """Returns the most serious doubt and the number of others, as a clause; empty without doubts."""
    doubts = lines_of(doubts_in(findings))
    more = "" if len(doubts) < 2 else f" ({len(doubts) - 1} more)"
    return f"{doubts[0].rstrip('.')}{more}" if doubts else ""


def lines_of(findings: Sequence[RecordFinding]) -> list[str]:
    """Returns the findings as lines, the most serious first."""
    order = {"fatal": 0, "doubt": 1, "note": 2}
    return [f.line for f in sorted(findings, key=lambda f: order[f.consequence])]


# --- Words for findings


CHECK_COLUMNS = "Check which column is which, and the units beside them."
MOST_TIMES = 10
"""Number of times that a finding lists; it counts the others."""


def at_times(times: Sequence[float]) -> str:
    """Returns `at 1.23 s`, or the first few of many."""
    shown = [f"{time:.2f}" for time in times[:MOST_TIMES]]
    more = len(times) - len(shown)
    return f"at {', '.join(shown)} s" + (f" and {more} more" if more else "")


def times_of(count: int, what: str) -> str:
    """Returns `1 wrap`, `3 wraps`."""
    return f"{count} {what}{'' if count == 1 else 's'}"


def number(value: float) -> str:
    """Formats a measured value for a sentence."""
    return f"{float(f'{value:.3g}'):g}"
