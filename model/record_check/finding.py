"""What a check of a record found, as data with its words."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Literal

from daq.contracts.frozen import FrozenRecord

Consequence = Literal["fatal", "doubt", "note"]
"""fatal: nothing can be computed. doubt: an answer would be of the record's fault. note: to be known."""
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
    "no-sensor",
    "position-unit",
    "saturated",
    "short",
    "spikes",
    "stuck",
    "time-scale",
    "units-differ",
    "wraps",
]


class RecordFinding(FrozenRecord):
    """One thing that a record, or the machine file beside it, says and that cannot be, or should be known.

    Args:
        record: what the record is called; empty where the finding is of the machine file. joint: from 1; None: of all.
        times: s of the record's own clock, the first of `count`. value, allowed: as measured, and the most (or the
            value) that was expected, in `unit`.
        says, advice: a sentence each.
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
        """The finding as one line, with its place."""
        place = "" if self.joint is None else f"joint {self.joint}: "
        record = f"{self.record}: " if self.record else ""
        advice = f" {self.advice}" if self.advice else ""
        return f"{record}{place}{self.says}{advice}"


def doubts_in(findings: Iterable[RecordFinding]) -> tuple[RecordFinding, ...]:
    """The findings for which an answer would be of the record's fault."""
    return tuple(f for f in findings if f.consequence != "note")


def doubts_headline(findings: Sequence[RecordFinding]) -> str:
    """The gravest doubt, and how many there are beside it; empty where nothing is doubted. A clause."""
    doubts = lines_of(doubts_in(findings))
    more = "" if len(doubts) < 2 else f" ({len(doubts) - 1} more)"
    return f"{doubts[0].rstrip('.')}{more}" if doubts else ""


def lines_of(findings: Sequence[RecordFinding]) -> list[str]:
    """The findings as lines, the gravest first."""
    order = {"fatal": 0, "doubt": 1, "note": 2}
    return [f.line for f in sorted(findings, key=lambda f: order[f.consequence])]
