"""`daq check`: finds impossible contents of records before they are used."""

from __future__ import annotations

from typing import Annotated

import typer

from daq_cli.app.context import JsonOption, print_json
from daq_cli.models.model_input import (
    MODEL_HELP,
    TraceFolderOption,
    TracesArgument,
    check_made_for,
    machine_of,
    read_model,
    read_traces,
)
from daq_cli.models.record_doubts import end_if_doubted, print_fields, print_record, say_what_is_lacking
from daq_cli.robot.access import robot_of

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
    """Show the contents of traces, and check units, signs, columns, times and readings. The exit code is 2 if a record
    is doubted."""
    from model.machine_model.model import base_model
    from model.record_check.check import check_records
    from model.record_check.fields import field_reports

    robot = robot_of(context)
    given = None if model is None else read_model(model)
    read = read_traces(robot, folder, traces)
    of = given or base_model(machine_of(read, robot, traces))
    say_what_is_lacking(of, read)
    check_made_for(of.machine, read, traces)
    found, fields = check_records(of, read), field_reports(of, read)
    if json:
        print_json(
            {
                "fields": [one.model_dump(mode="json") for one in fields],
                "findings": [one.model_dump(mode="json") for one in found],
            }
        )
        end_if_doubted(found)
        return
    print_fields(fields)
    if found:
        print_record(found)
    else:
        print(f"no doubts about {len(read)} trace{'' if len(read) == 1 else 's'}")
    end_if_doubted(found)
