"""Results of a fit for one parameter and for one joint."""

from __future__ import annotations

import math
from collections.abc import Sequence
from html import escape
from typing import Literal

from daq.contracts.frozen import FrozenRecord
from model.blocks import Cell, Table, Tone, numbers
from model.fitting.identifiability import IdentifiabilityReport, Verdict


class FittedParameter(FrozenRecord):
    """One parameter after a fit.

    `value`, `deviation` and the 95 % interval `low` to `high` are None unless the data determine the parameter.
    `model_value` is the value in the fitted model, which needs one in any case.
    """

    name: str
    unit: str
    verdict: Verdict
    reason: str
    value: float | None
    deviation: float | None
    low: float | None
    high: float | None
    model_value: float
    before: float
    expected: float | None
    expected_deviation: float | None
    at_bound: Literal["low", "high"] | None


class JointError(FrozenRecord):
    """Root mean square of simulated − measured on one joint over all traces, and the noise of the measurement.

    `noise`: the error of a right model, with noise in its control loop; None in older results.
    """

    joint: int
    unit: str
    before: float
    after: float
    floor: float
    noise: float | None = None


# --- Formats fitted parameters for people: terminal, page and notebook show the same table


WORSE = 1.5
"""Factor by which a joint's error must have grown to raise a doubt; a fit may give up a little on one joint for others.
"""
ABOVE_NOISE = 30.0
"""Multiple of the noise that it must exceed, too."""
COLUMNS = ("parameter", "value", "95 % interval", "unit", "before")
"""Output for a terminal or a notebook."""


def parameter_table(parameters: Sequence[FittedParameter]) -> Table:
    """Returns values with intervals where the data give them; in brackets the model's values where they do not."""
    return Table(
        (*COLUMNS, "expected"),
        tuple(map(_row, parameters)),
        "In brackets: values that the traces do not determine; others fit as well. "
        "Intervals allow for the correlation of the residual.",
    )


def _row(p: FittedParameter) -> tuple[Cell, ...]:
    tone: Tone = "plain"
    if p.value is None or p.low is None or p.high is None or p.deviation is None:
        value, tone = f"({p.model_value:.4g})", "warning"
        interval = {"combination": "only in combination", "unknown": "not determined"}.get(p.verdict, p.verdict)
    else:
        digits = significant(p.value, p.deviation)
        bound = "" if p.at_bound is None else f", at its {'lower' if p.at_bound == 'low' else 'upper'} bound"
        value, interval = f"{p.value:.{digits}g}", f"{p.low:.{digits}g} to {p.high:.{digits}g}{bound}"
    expected = "–" if p.expected is None else f"{p.expected:.4g} ± {p.expected_deviation:.2g}"
    fitted = numbers(value, interval, tone=tone)
    return (Cell(p.name), *fitted, Cell(p.unit), *numbers(f"{p.before:.5g}", expected))


def significant(value: float, deviation: float) -> int:
    """Returns the number of digits of a value that shows its deviation with two digits, at most seven."""
    if value == 0 or deviation <= 0:
        return 3
    return max(2, min(7, 2 + math.floor(math.log10(abs(value))) - math.floor(math.log10(deviation))))


def known_of(parameters: Sequence[FittedParameter]) -> str:
    """Returns in words how many of them the data determine."""
    return f"{sum(p.value is not None for p in parameters)} of {len(parameters)} parameters known"


def doubt_of(errors: Sequence[JointError]) -> str:
    """Returns one line if a fit ends much farther from its records than it began; its values are then unusable. Else
    empty.

    This can happen because the fit minimises a robust sum of squares, which may fall all the same.
    """
    worse = [one for one in errors if one.after > WORSE * one.before and one.after > ABOVE_NOISE * one.floor]
    if not worse:
        return ""
    joints = f"joint{'s' if len(worse) > 1 else ''} {', '.join(str(one.joint) for one in worse)}"
    return (
        f"the fitted model is farther from the records than before ({joints}): do not use its values. Without a "
        "controller that holds the arm, a simulation soon departs from any record: "
        "shorten the records, or compare torques"
    )


def text_of(parameters: Sequence[FittedParameter], report: IdentifiabilityReport) -> str:
    """Returns the table in columns of spaces, and a line for each combination that is not determined."""
    return "\n".join([str(parameter_table(parameters).only(*COLUMNS)), *_undetermined(report)])


def html_of(
    title: str, parameters: Sequence[FittedParameter], report: IdentifiabilityReport, below: Sequence[str] = ()
) -> str:
    """Returns the same as HTML for a notebook, under a title, with further lines below. Every text is escaped."""
    lines = "<br/>".join(map(escape, [*_undetermined(report), *below]))
    return f"<div><b>{escape(title)}</b>{parameter_table(parameters).only(*COLUMNS).html()}{lines}</div>"


def _undetermined(report: IdentifiabilityReport) -> list[str]:
    return [f"not determined: {one.text}" for one in report.undetermined]
