"""Fitted parameters as tables, for terminals and notebooks."""

from __future__ import annotations

import math
from collections.abc import Sequence
from html import escape
from typing import TYPE_CHECKING, Protocol

if TYPE_CHECKING:
    from model.fitting.identifiability import IdentifiabilityReport


class ShownParameter(Protocol):
    """A parameter after a fit, as `model.fitting.result.FittedParameter` has it: that file shows itself by this one."""

    @property
    def name(self) -> str:
        """Name."""

    @property
    def unit(self) -> str:
        """Unit."""

    @property
    def verdict(self) -> str:
        """What the data tell of it."""

    @property
    def value(self) -> float | None:
        """Value; None where the data do not determine it, as the next three."""

    @property
    def deviation(self) -> float | None:
        """Standard deviation."""

    @property
    def low(self) -> float | None:
        """Lower end of the 95 % interval."""

    @property
    def high(self) -> float | None:
        """Upper end."""

    @property
    def model_value(self) -> float:
        """What the fitted model carries, whether or not the data determine it."""

    @property
    def before(self) -> float:
        """Value before the fit."""

    @property
    def at_bound(self) -> str | None:
        """`low` or `high`."""


class ShownError(Protocol):
    """The error of one joint, as `model.fitting.result.JointError` has it."""

    @property
    def joint(self) -> int:
        """Number, from 1."""

    @property
    def before(self) -> float:
        """Root mean square before the fit, rad or m, as the next two."""

    @property
    def after(self) -> float:
        """After it."""

    @property
    def floor(self) -> float:
        """Noise of the measurement."""


WORSE = 1.5
"""By which factor a joint's error must have grown to be doubted: a little is given away for other joints."""
ABOVE_NOISE = 30.0
"""How many times the noise it must be, too."""
COLUMNS = ("parameter", "value", "95 % interval", "unit", "before")
NUMBERS = (False, True, True, False, True)
"""Which columns hold numbers, which are set flush right."""


def row_of(p: ShownParameter) -> tuple[str, ...]:
    """The cells of COLUMNS for one parameter; in brackets what the model carries where the data do not determine it."""
    before = f"{p.before:.5g}"
    if p.value is None or p.low is None or p.high is None or p.deviation is None:
        what = {"combination": "only in combination", "unknown": "not determined"}.get(p.verdict, p.verdict)
        return p.name, f"({p.model_value:.4g})", what, p.unit, before
    digits = significant(p.value, p.deviation)
    bound = "" if p.at_bound is None else f", at its {'lower' if p.at_bound == 'low' else 'upper'} bound"
    interval = f"{p.low:.{digits}g} to {p.high:.{digits}g}{bound}"
    return p.name, f"{p.value:.{digits}g}", interval, p.unit, before


def significant(value: float, deviation: float) -> int:
    """Number of digits of a value that shows its deviation with two digits, at most seven."""
    if value == 0 or deviation <= 0:
        return 3
    return max(2, min(7, 2 + math.floor(math.log10(abs(value))) - math.floor(math.log10(deviation))))


def known_of(parameters: Sequence[ShownParameter]) -> str:
    """How many of them the data determine, in words."""
    return f"{sum(p.value is not None for p in parameters)} of {len(parameters)} parameters known"


def doubt_of(errors: Sequence[ShownError]) -> str:
    """One line where a fit ends much farther from its records than it began, so that neither values nor intervals can
    be relied on; empty where it does not.

    The sum of squares that a fit makes small is robust: it may fall all the same.
    """
    worse = [one for one in errors if one.after > WORSE * one.before and one.after > ABOVE_NOISE * one.floor]
    if not worse:
        return ""
    joints = f"joint{'s' if len(worse) > 1 else ''} {', '.join(str(one.joint) for one in worse)}"
    return (
        f"the fitted model is farther from the records than before ({joints}): do not use its values. Where no "
        "controller holds the arm, a simulation soon leaves any record: shorten the records, or compare torques"
    )


def text_of(parameters: Sequence[ShownParameter], report: IdentifiabilityReport) -> str:
    """The table in columns of spaces, and a line for each combination that is not determined."""
    rows = [COLUMNS, *map(row_of, parameters)]
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    lines = []
    for row in rows:
        cells = zip(row, widths, NUMBERS, strict=True)
        lines.append("  ".join(cell.rjust(width) if number else cell.ljust(width) for cell, width, number in cells))
    return "\n".join(line.rstrip() for line in [*lines, *_undetermined(report)])


def html_of(
    title: str, parameters: Sequence[ShownParameter], report: IdentifiabilityReport, below: Sequence[str] = ()
) -> str:
    """The same for a notebook, under a title, with further lines below. Every text is escaped."""
    head = _cells(COLUMNS, "th")
    body = "".join(f"<tr>{_cells(row_of(p), 'td')}</tr>" for p in parameters)
    lines = "<br/>".join(map(escape, [*_undetermined(report), *below]))
    return f"<div><b>{escape(title)}</b><table><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table>{lines}</div>"


def _cells(row: Sequence[str], tag: str) -> str:
    flush = {True: "right", False: "left"}
    return "".join(
        f'<{tag} style="text-align:{flush[number]}">{escape(cell)}</{tag}>'
        for cell, number in zip(row, NUMBERS, strict=True)
    )


def _undetermined(report: IdentifiabilityReport) -> list[str]:
    return [f"not determined: {one.text}" for one in report.undetermined]
