"""Prints a table of the figures of every joint that moved."""

from __future__ import annotations

from typing import TYPE_CHECKING

from daq_cli.app.context import print_table

if TYPE_CHECKING:
    from daq.contracts.trace import Trace

HEADS = ("joint", "from", "to", "overshoot", "rise time", "largest error", "error at the end", "largest drive")


def print_figures(trace: Trace) -> None:
    """Prints the figures of every joint that moved; nothing if none did."""
    from rich.table import Table

    from daq.traces.summary import joint_figures

    table = Table(box=None, header_style="bold")
    for title in HEADS:
        table.add_column(title, justify="right")
    moved = [one for one in joint_figures(trace) if one.moved]
    for one in moved:
        rise = "–" if one.rise_time is None else f"{one.rise_time:.2f} s"
        drive = "–" if one.largest_drive is None else f"{one.largest_drive:.1f} {trace.drive_unit}"
        ends = (_angle(value, one.unit) for value in (one.start, one.end, one.overshoot))
        errors = (_angle(value, one.unit) for value in (one.largest_error, one.final_error))
        table.add_row(str(one.joint), *ends, rise, *errors, drive)
    if moved:
        print_table(table)
    if any(one.overshoot is None for one in moved):
        print("Overshoot and rise time need one change of the set point, in one direction.")


def _angle(value: float | None, unit: str) -> str:
    return "–" if value is None else f"{round(value, 2) + 0.0:.2f}{'' if unit == '°' else ' '}{unit}"
