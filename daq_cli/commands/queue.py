"""`daq queue`: the queue of a server's robot."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

import typer

from daq.contracts.errors import SpecError
from daq_cli.app.context import Invocation, JsonOption, YesOption, invocation, print_json

if TYPE_CHECKING:
    from daq.client import Robot
    from daq.contracts.service.queue import QueueStatus

app = typer.Typer(
    add_completion=False, help="The queue of a server's robot: show, pause, resume.", no_args_is_help=True
)


@app.command()
def show(context: typer.Context, json: JsonOption = False) -> None:
    """Whether experiments are taken, why not, and what waits."""
    with _robot(invocation(context)) as robot:
        status, waiting = robot.queue.status(), robot.queue.waiting()
    if json:
        print_json({"status": status.model_dump(mode="json"), "waiting": [w.model_dump(mode="json") for w in waiting]})
        return
    _tell(status)
    for one in waiting:
        when = "" if one.at is None else f", not before {one.at:%Y-%m-%d %H:%M:%S %Z}"
        print(f"  {one.id}  {one.spec.name or one.spec.trajectory.kind}, by {one.submitted_by}{when}")


@app.command()
def pause(context: typer.Context) -> None:
    """Let no other experiment begin; one that runs goes on."""
    with _robot(invocation(context)) as robot:
        _tell(robot.queue.pause())


@app.command()
def resume(context: typer.Context, yes: YesOption = False) -> None:
    """Let the queue move the arm again. LOOK AT IT FIRST: what waits begins."""
    from daq_cli.robot.remote.robot import connected_status, require_word

    with _robot(invocation(context)) as robot:
        _tell(robot.queue.resume(moves_real_arm=require_word(connected_status(robot), yes)))


@contextmanager
def _robot(call: Invocation) -> Iterator[Robot]:
    from daq_cli.robot.remote.robot import remote_robot

    if call.server is None:
        raise SpecError("queue: a service has it: `daq --server http://host:8300 queue …`, or set DAQ_SERVER")
    with remote_robot(call) as robot:
        yield robot


def _tell(status: QueueStatus) -> None:
    state = f"paused: {status.reason}" if status.paused else f"open: {status.reason}"
    print(f"{state}; {status.queued} waiting" + (f"; {status.running} runs" if status.running else ""))
    if status.waiting_for:
        print(f"waiting for {status.waiting_for}")
