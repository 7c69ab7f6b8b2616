"""`daq check`: what records say that cannot be, before anything is computed from them."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import typer

from daq.contracts import exit_codes
from daq_cli.app.context import JsonOption, print_json, print_table
from daq_cli.models.model_input import (
    MODEL_HELP,
    TraceFolderOption,
    TracesArgument,
    check_made_for,
    machine_of,
    read_model,
    read_traces,
)
from daq_cli.robot.access import robot_of

if TYPE_CHECKING:
    from collections.abc import Sequence

    from model.record_check.finding import RecordFinding

app = typer.Typer(add_completion=False)


@app.command()
def check(
    context: typer.Context,
    traces: TracesArgument,
    model: Annotated[
        str | None, typer.Option(help=f"The model of the machine (default: the traces'). {MODEL_HELP}")
    ] = None,
    folder: TraceFolderOption = None,
    json: JsonOption = False,
) -> None:
    """Check units, signs, columns, times and readings of traces. The exit code is 2 where any is doubted."""
    from model.machine_model.model import base_model
    from model.record_check.check import check_records
    from model.record_check.finding import doubts_in

    robot = robot_of(context)
    read = read_traces(robot, folder, traces)
    of = base_model(machine_of(read, robot, traces)) if model is None else read_model(model)
    check_made_for(of.machine, read, traces)
    found = check_records(of, read)
    if json:
        print_json([finding.model_dump(mode="json") for finding in found])
    else:
        _print(found, len(read))
    if doubts_in(found):
        raise typer.Exit(exit_codes.WRONG_INPUT)


def _print(found: Sequence[RecordFinding], traces: int) -> None:
    from rich.table import Table

    if not found:
        print(f"nothing is doubted in {traces} trace{'' if traces == 1 else 's'}")
        return
    table = Table("", "trace", "joint", "what", "what to do", box=None, header_style="bold")
    for one in found:
        joint = "" if one.joint is None else str(one.joint)
        table.add_row(one.consequence, one.record, joint, one.says, one.advice)
    print_table(table)
