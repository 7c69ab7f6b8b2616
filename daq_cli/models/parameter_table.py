"""Prints tables of results, and remarks on fitted parameters."""

from __future__ import annotations

from typing import TYPE_CHECKING

from daq_cli.app.context import print_prose, print_table

if TYPE_CHECKING:
    from collections.abc import Sequence

    from model.blocks import Table
    from model.fitting.fitted import FittedParameter
    from model.fitting.identifiability import IdentifiabilityReport


def print_rows(table: Table) -> None:
    """Prints a table of a result, as wide as the terminal."""
    from rich.table import Table as Printed

    shown = Printed(box=None, header_style="bold")
    for name, number in zip(table.head, table.numeric, strict=True):
        shown.add_column(name, justify="right" if number else "left", overflow="fold")
    for row in table.rows:
        shown.add_row(*(cell.text for cell in row))
    print_table(shown)


def print_parameters(parameters: Sequence[FittedParameter]) -> None:
    """Prints one line per parameter; without a value if the data do not determine it."""
    from model.fitting.fitted import COLUMNS, parameter_table

    print_rows(parameter_table(parameters).only(*COLUMNS))


def print_undetermined(report: IdentifiabilityReport) -> None:
    """Prints what the records do not determine, one paragraph each."""
    for combination in report.undetermined:
        print_prose(combination.text, "  not determined: ")


def print_on_the_edge(links: Sequence[str]) -> None:
    """Prints which bodies a fit with consistent inertias left at the boundary of physical consistency, if any."""
    if links:
        print_prose(
            f"{', '.join(links)}: flat or thin after the fit; the traces fit a body that cannot exist: something "
            "else is missing from the model, or they do not determine these moments"
        )
