"""`daq queue`: the queue of a server's robot."""

from __future__ import annotations

from typing import TYPE_CHECKING

import typer

from daq_cli.app.consent import ConsentPrompt
from daq_cli.app.context import JsonOption, YesOption, print_json
from daq_cli.robot.access import robot_of

if TYPE_CHECKING:
    from daq.contracts.service.queue import QueueStatus

app = typer.Typer(
    add_completion=False, help="Show, pause and resume the queue of a server's robot.", no_args_is_help=True
)


@app.command()
def show(context: typer.Context, json: JsonOption = False) -> None:
    """Show whether experiments are started, why not, and which wait."""
    with robot_of(context).service("queue") as robot:
        status, waiting = robot.queue.status(), robot.queue.waiting()
    if json:
        print_json({"status": status.model_dump(mode="json"), "waiting": [w.model_dump(mode="json") for w in waiting]})
        return
    _print_status(status)
    for one in waiting:
        when = "" if one.at is None else f", not before {one.at:%Y-%m-%d %H:%M:%S %Z}"
        print(f"  {one.id}  {one.spec.name or one.spec.trajectory.kind}, by {one.submitted_by}{when}")


@app.command()
def pause(context: typer.Context) -> None:
    """Let no further experiment start; a running one goes on."""
    with robot_of(context).service("queue") as robot:
        _print_status(robot.queue.pause())


@app.command()
def resume(context: typer.Context, yes: YesOption = False) -> None:
    """Let the queue move the arm again. LOOK AT THE ARM FIRST: waiting experiments start."""
    from daq_cli.robot.remote.connection import connected_status, require_consent

    with robot_of(context).service("queue") as robot:
        real = require_consent(connected_status(robot), ConsentPrompt(yes))
        _print_status(robot.queue.resume(moves_real_arm=real))


def _print_status(status: QueueStatus) -> None:
    state = f"paused: {status.reason}" if status.paused else f"open: {status.reason}"
    print(f"{state}; {status.queued} waiting" + (f"; {status.running} runs" if status.running else ""))
    if status.waiting_for:
        print(f"waiting for {status.waiting_for}")
