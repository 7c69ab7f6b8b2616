"""Fitted parameters as a table on standard output."""

from __future__ import annotations

from typing import TYPE_CHECKING

import typer

from daq.contracts import exit_codes
from daq_cli.app.context import print_table
from model.record_check.finding import doubts_in, lines_of

if TYPE_CHECKING:
    from collections.abc import Sequence

    from model.fitting.result import FittedParameter
    from model.record_check.finding import RecordFinding


def print_parameters(parameters: Sequence[FittedParameter]) -> None:
    """Prints one line for each parameter; without a number where the data do not determine one."""
    from rich.table import Table

    from model.fitting.shown import COLUMNS, NUMBERS, row_of

    table = Table(box=None, header_style="bold")
    for name, number in zip(COLUMNS, NUMBERS, strict=True):
        table.add_column(name, justify="right" if number else "left", overflow="fold")
    for p in parameters:
        table.add_row(*row_of(p))
    print_table(table)


def end_if_doubted(findings: Sequence[RecordFinding]) -> None:
    """Ends the command with the exit code of `daq check` where a record is doubted, behind all that it prints."""
    if doubts_in(findings):
        raise typer.Exit(exit_codes.WRONG_INPUT)


def print_record(findings: Sequence[RecordFinding]) -> None:
    """What the check of the records found, a line each: doubts as CHECK, others as record."""
    for line in lines_of(doubts_in(findings)):
        print(f"CHECK {line}")
    for line in lines_of([finding for finding in findings if finding.consequence == "note"]):
        print(f"record {line}")


def print_on_the_edge(links: Sequence[str]) -> None:
    """Prints which bodies a fit with consistent inertias left on the edge of what can exist, if any."""
    if links:
        print(
            f"{', '.join(links)}: flat or thin after the fit; the traces ask for a body that cannot exist: something "
            "else is missing from the model, or they do not tell these moments"
        )
