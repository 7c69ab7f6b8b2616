"""Fitted parameters as a table on standard output."""

from __future__ import annotations

from typing import TYPE_CHECKING

from daq_cli.app.context import print_prose, print_table

if TYPE_CHECKING:
    from collections.abc import Sequence

    from model.fitting.identifiability import IdentifiabilityReport
    from model.fitting.result import FittedParameter


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


def print_undetermined(report: IdentifiabilityReport) -> None:
    """What records do not determine, a paragraph each."""
    for combination in report.undetermined:
        print_prose(combination.text, "  not determined: ")


def print_on_the_edge(links: Sequence[str]) -> None:
    """Prints which bodies a fit with consistent inertias left on the edge of what can exist, if any."""
    if links:
        print_prose(
            f"{', '.join(links)}: flat or thin after the fit; the traces ask for a body that cannot exist: something "
            "else is missing from the model, or they do not tell these moments"
        )
