"""`daq reset`: the explicit end of a stop."""

from __future__ import annotations

from typing import Annotated

import typer

from daq.contracts.errors import DaqError
from daq.contracts.limp import limp_line
from daq_cli.app.context import JsonOption, console, invocation, print_json
from daq_cli.robot.local_robot import connected

app = typer.Typer(add_completion=False)


class NotFrozenError(DaqError):
    """The board has not confirmed that it took the measured posture as its set points."""

    exit_code = 3


@app.command()
def reset(
    context: typer.Context,
    here: Annotated[
        bool,
        typer.Option("--here", help="First make the measured posture the set points: of limp joints, or to yield."),
    ] = False,
    json: JsonOption = False,
) -> None:
    """End the freeze of a stop. Set points stay where the stop put them, or with --here become the present posture."""
    from firmware_protocol.commands import StatusFlag

    if invocation(context).server is not None:
        from daq_cli.robot.remote.robot import remote_robot

        with remote_robot(invocation(context)) as robot:
            text = robot.reset(here=here).text
        if json:
            print_json({"server": invocation(context).server, "here": here, "text": text})
        else:
            print(text)
        return
    with connected(invocation(context)) as controller:
        status = controller.status()
        frozen, stop = StatusFlag.FROZEN in status.flags, status.stop  # this stop is ended, and none that comes later
        if here:
            # A second stop would change nothing: the board measures the posture when a stop begins.
            controller.release(stop)
            stopped = controller.stop()
            if not stopped.acknowledged:
                raise NotFrozenError(f"reset --here: {stopped.problem}; the set points are not known to be here")
            stop = controller.status().stop
        controller.release(stop)
        limp = limp_line(controller.gains())
    holds = "takes set points again" if limp else "the arm holds its posture and takes set points again"
    text = f"released: {holds}" + ("; the set points are the posture measured now" if here else "")
    if not frozen and not here:
        text = "was not stopped"
    if json:
        print_json({"server": None, "here": here, "text": text})
        return
    if limp:
        console().print(limp)
    print(text)
