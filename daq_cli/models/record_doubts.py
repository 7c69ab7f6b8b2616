"""The check of records that precedes the computation in every model command."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import typer

from daq.contracts import exit_codes
from daq_cli.app.context import console, print_json, print_prose, print_table
from model.record_check.finding import doubts_in, lines_of

if TYPE_CHECKING:
    from collections.abc import Sequence

    from daq.contracts.trace import Trace
    from model.machine_model.model import Model
    from model.record_check.fields import FieldReport
    from model.record_check.finding import RecordFinding

DespiteDoubtsOption = Annotated[
    bool, typer.Option("--despite-doubts", help="Compute although the check of the records raises doubts.")
]


def stop_if_doubted(
    model: Model, traces: Sequence[Trace], *, despite_doubts: bool, as_json: bool, torques: bool = False
) -> None:
    """Checks records before the computation, and ends the command if one is doubted.

    Raises TraceError if nothing can be computed at all.
    """
    from model.record_check.check import check_records, require_computable

    found = check_records(model, traces, torques=torques)
    require_computable(found)
    if not as_json:
        say_what_is_lacking(model, traces)
    if despite_doubts or not doubts_in(found):
        return
    if as_json:
        print_json({"record": [finding.model_dump(mode="json") for finding in found]})
    else:
        print_record(found)
    console().print("nothing is computed, since the check raises doubts; --despite-doubts computes anyway")
    end_if_doubted(found)


def say_what_is_lacking(model: Model, traces: Sequence[Trace]) -> None:
    """Prints which fields an answer needs but the records lack, by joint, on standard error."""
    from model.record_check.fields import field_reports

    for report in field_reports(model, traces):
        if report.weight == "lacking":
            joint = f"joint {report.place}: " if report.joint else ""
            print_prose(f"{report.record}: {joint}{report.field}: {report.there}. {report.means}", "LACKS  ", err=True)


def print_fields(reports: Sequence[FieldReport]) -> None:
    """Prints the fields of each record, and what each one means for an answer."""
    from rich.table import Table

    for record in dict.fromkeys(report.record for report in reports):
        table = Table(box=None, header_style="bold", title=record or "machine file", title_justify="left")
        for title in ("joint", "field", "is there", "for the answer"):
            table.add_column(title)
        for report in reports:
            if report.record == record:
                table.add_row(report.place, report.field, report.there, report.means)
        print_table(table)


def end_if_doubted(findings: Sequence[RecordFinding]) -> None:
    """Ends the command with the exit code of `daq check` if a record is doubted, after all other output."""
    if doubts_in(findings):
        raise typer.Exit(exit_codes.WRONG_INPUT)


def print_record(findings: Sequence[RecordFinding]) -> None:
    """Prints the findings of the record check, one paragraph each: doubts as CHECK, others as record."""
    for line in lines_of(doubts_in(findings)):
        print_prose(line, "CHECK  ")
    for line in lines_of([finding for finding in findings if finding.consequence == "note"]):
        print_prose(line, "record ")
