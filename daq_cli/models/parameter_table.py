"""Fitted parameters as a table on standard output."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from daq_cli.app.context import print_table

if TYPE_CHECKING:
    from collections.abc import Sequence

    from model.fitting.result import FittedParameter


def print_parameters(parameters: Sequence[FittedParameter]) -> None:
    """Prints one line for each parameter; without a number where the data do not determine one."""
    from rich.table import Table

    table = Table(box=None, header_style="bold")
    for name in ("parameter", "value", "95 % interval", "unit", "before", ""):
        number = name in ("value", "95 % interval", "before")
        table.add_column(name, justify="right" if number else "left", overflow="fold")
    for p in parameters:
        table.add_row(*_row(p))
    print_table(table, 140)


def _row(p: FittedParameter) -> tuple[str, ...]:
    bound = "" if p.at_bound is None else f"at its {'lower' if p.at_bound == 'low' else 'upper'} bound"
    if p.value is None or p.low is None or p.high is None or p.deviation is None:
        what = {"combination": "only in combination", "unknown": "not determined"}.get(p.verdict, p.verdict)
        return p.name, "–", "–", p.unit, f"{p.before:.5g}", what
    digits = significant(p.value, p.deviation)
    return (
        p.name,
        f"{p.value:.{digits}g}",
        f"{p.low:.{digits}g} to {p.high:.{digits}g}",
        p.unit,
        f"{p.before:.5g}",
        bound,
    )


def significant(value: float, deviation: float) -> int:
    """Number of digits of a value that shows its deviation with two digits, at most seven."""
    if value == 0 or deviation <= 0:
        return 3
    return max(2, min(7, 2 + math.floor(math.log10(abs(value))) - math.floor(math.log10(deviation))))
