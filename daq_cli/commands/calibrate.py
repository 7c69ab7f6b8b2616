"""`daq calibrate`: measures properties of the machine."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from daq_cli.app import completion
from daq_cli.app.consent import ConsentPrompt
from daq_cli.app.context import JsonOption, YesOption, print_json
from daq_cli.robot.access import robot_of

app = typer.Typer(add_completion=False, help="Measure what the machine really does.", no_args_is_help=True)


@app.callback()
def calibrations() -> None:
    """Measure what the machine really does."""


@app.command()
def gain(
    context: typer.Context,
    joints: Annotated[
        str, typer.Option(help="Joints to measure: 1-3, 1,3 or 2.", autocompletion=completion.joints)
    ] = "1-3",
    trace: Annotated[
        str | None,
        typer.Option(
            help="Use this trace instead of moving: a file, a number, `last`.", autocompletion=completion.traces
        ),
    ] = None,
    folder: Annotated[Path | None, typer.Option(help="Folder for the trace (default: the configured one).")] = None,
    yes: YesOption = False,
    json: JsonOption = False,
) -> None:
    """Measure the actual proportional gain from errors and powers at several postures, as the 1991 source did
    (section 6.5)."""
    from daq.calibration import gain_experiment, gains_from_trace
    from daq.contracts.experiment import parse_joints
    from daq.traces.reader import read_trace
    from daq_cli.robot.experiment import acquire_complete

    robot = robot_of(context)
    wanted = parse_joints(joints)
    place = folder or robot.call.trace_folder
    if trace is None:
        path = acquire_complete(robot, gain_experiment(wanted), robot.machine, place, ConsentPrompt(yes)).trace
    else:
        path = robot.find_trace(place, trace)
    measured = read_trace(path, robot.call.trace_limits)
    # Counts and radians of a trace belong to its own calibration, not to the present one.
    machine = measured.record.machine or robot.machine
    found = [one for one in gains_from_trace(measured, machine) if one.joint in wanted]
    if json:
        print_json({"trace": path, "gains": [one.as_data() for one in found]})
        return
    for one in found:
        print(one)
    print(f"trace: {path}")
