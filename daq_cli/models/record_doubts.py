"""The check of records, which every command of models makes before it computes anything."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import typer

from daq.contracts import exit_codes
from daq_cli.app.context import console, print_json, print_prose
from model.record_check.finding import doubts_in, lines_of

if TYPE_CHECKING:
    from collections.abc import Sequence

    from daq.contracts.trace import Trace
    from model.machine_model.model import Model
    from model.record_check.finding import RecordFinding

DespiteDoubtsOption = Annotated[
    bool, typer.Option("--despite-doubts", help="Compute although the check of the records raises doubts.")
]


def stop_if_doubted(model: Model, traces: Sequence[Trace], *, despite_doubts: bool, as_json: bool) -> None:
    """Checks records before anything is computed from them, and ends the command where one is doubted.

    Raises TraceError where nothing can be computed at all.
    """
    from model.record_check.check import check_records, require_computable

    found = check_records(model, traces)
    require_computable(found)
    if despite_doubts or not doubts_in(found):
        return
    if as_json:
        print_json({"record": [finding.model_dump(mode="json") for finding in found]})
    else:
        print_record(found)
    console().print("nothing is computed of a doubted record; --despite-doubts computes all the same")
    end_if_doubted(found)


def end_if_doubted(findings: Sequence[RecordFinding]) -> None:
    """Ends the command with the exit code of `daq check` where a record is doubted, behind all that it prints."""
    if doubts_in(findings):
        raise typer.Exit(exit_codes.WRONG_INPUT)


def print_record(findings: Sequence[RecordFinding]) -> None:
    """What the check of the records found, a paragraph each: doubts as CHECK, others as record."""
    for line in lines_of(doubts_in(findings)):
        print_prose(line, "CHECK  ")
    for line in lines_of([finding for finding in findings if finding.consequence == "note"]):
        print_prose(line, "record ")
