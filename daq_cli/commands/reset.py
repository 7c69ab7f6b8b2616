"""`daq reset`: ends a stop explicitly."""

from __future__ import annotations

from typing import Annotated

import typer

from daq_cli.app.context import JsonOption, print_json
from daq_cli.robot.access import robot_of

app = typer.Typer(add_completion=False)


@app.command()
def reset(
    context: typer.Context,
    here: Annotated[
        bool,
        typer.Option("--here", help="First make the measured posture the set points: for limp joints, or to yield."),
    ] = False,
    json: JsonOption = False,
) -> None:
    """End the freeze of a stop. Set points stay where the stop put them, or with --here become the present posture."""
    robot = robot_of(context)
    text = robot.reset(adopt_posture=here)
    if json:
        print_json({"server": robot.call.server, "here": here, "text": text})
        return
    print(text)
