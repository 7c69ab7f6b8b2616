"""`daq stop`: stops every robot at once, from any terminal, without asking first."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING, Annotated

import typer

from daq.contracts import exit_codes
from daq.contracts.errors import DaqError
from daq_cli.app.context import Invocation, JsonOption, invocation, print_json, printable
from daq_cli.robot.access import robot_of

if TYPE_CHECKING:
    pass

app = typer.Typer(add_completion=False)


@app.command()
def stop(
    context: typer.Context,
    robot: Annotated[
        str | None, typer.Option("--robot", help="Stop only this robot. An unknown name stops all.")
    ] = None,
    json: JsonOption = False,
) -> None:
    """Freeze every robot that is being moved, and the configured ones: set points become the measured posture.

    With --server this stops the robots of that service; with DAQ_SERVER, those and the ones that are moved from here.

    The exit code is 0 when every stop was confirmed by its board, and 3 when one was NOT DELIVERED or NOT CONFIRMED, or
    there was no robot. A program's stop never replaces the hardware's own.
    """
    from daq_cli.app import early_stop

    call = invocation(context)
    call.robot_option = robot or call.robot_option
    attempts = early_stop.attempts(call.robot_option) if call.stops_here else []
    if not attempts and call.stops_here and _is_unknown(call):
        line = f"no robot is called {call.robot_option}: every robot is stopped"
        if call.server is not None:
            line = f"no robot here is called {call.robot_option}: every robot that is moved from here is stopped"
        print(printable(line), file=sys.stderr, flush=True)
        if call.server is None:  # a service is still asked by the name: it may have a robot of this name
            call.robot_option = None
        attempts = early_stop.attempts()
    answers = [early_stop.answer_of(attempt) for attempt in attempts]
    answers += robot_of(context).stop({answer.port for answer in answers})
    if json:
        print_json([answer.as_data() for answer in answers])
    elif not answers:
        print("no robot is being moved from here, and none is configured: nothing to stop")
    else:
        for answer in answers:
            print(early_stop.line_of(answer))
    if not answers or not all(answer.confirmed for answer in answers):
        raise typer.Exit(exit_codes.NOT_REACHED)


def _is_unknown(call: Invocation) -> bool:
    """Whether the command line names a robot that is not configured here. If that is unclear, the name counts
    as unknown, and all robots are stopped."""
    if call.robot_option is None or call.port_option is not None:
        return False
    try:
        return call.robot_option not in call.configuration.names
    except DaqError:
        return True
