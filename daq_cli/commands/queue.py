"""`daq queue`: the queue of a server's robot."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import typer

from daq_cli.app.consent import ConsentPrompt
from daq_cli.app.context import JsonOption, YesOption, print_json
from daq_cli.robot.access import robot_of

if TYPE_CHECKING:
    from daq.contracts.service.experiments import Experiment, Schedule
    from daq.contracts.service.queue import QueueStatus

app = typer.Typer(
    add_completion=False,
    help="Show, pause and resume the queue of a server's robot; approve experiments; list and delete schedules.",
    no_args_is_help=True,
)


@app.command()
def show(context: typer.Context, json: JsonOption = False) -> None:
    """Show whether experiments are started, why not, and which ones wait."""
    with robot_of(context).service("queue") as robot:
        status, waiting = robot.queue.status(), robot.queue.waiting()
    if json:
        print_json({"status": status.model_dump(mode="json"), "waiting": [w.model_dump(mode="json") for w in waiting]})
        return
    _print_status(status)
    for one in waiting:
        when = "" if one.at is None else f", not before {one.at:%Y-%m-%d %H:%M:%S %Z}"
        print(f"  {one.id}  {_name(one)}, by {one.owner or one.submitted_by}{when}{_review(one)}")


@app.command()
def approve(
    context: typer.Context,
    experiment: Annotated[str, typer.Argument(help="Number of a waiting experiment, as `queue show` prints it.")],
    yes: Annotated[bool, typer.Option("--yes", help="Approve without being asked.")] = False,
) -> None:
    """Approve another person's experiment exactly as shown, so that it may move a real arm."""
    from daq.contracts.errors import SpecError
    from daq_cli.app.consent import can_be_asked

    with robot_of(context).service("queue") as robot:
        found = robot.experiments.get(experiment)
        print(f"{_name(found)}, by {found.owner or found.submitted_by}:")
        print(found.spec.model_dump_json(indent=2, exclude_defaults=True))
        motion = robot.experiments.preview(found.spec)
        joints = ", ".join(str(joint) for joint in motion.moving) or "none"
        print(f"moves joints {joints} for {motion.duration:.1f} s")
        if not yes and not (can_be_asked() and typer.confirm("Do you approve it?", err=True)):
            raise SpecError(f"experiment {experiment}: not approved; answer the question, or give --yes")
        print(f"{experiment}{_review(robot.experiments.approve(found))}")


@app.command()
def withdraw(
    context: typer.Context, experiment: Annotated[str, typer.Argument(help="Number of a waiting experiment.")]
) -> None:
    """End the approval of a waiting experiment."""
    with robot_of(context).service("queue") as robot:
        print(f"{experiment}{_review(robot.experiments.withdraw_approval(experiment))}")


@app.command()
def pause(context: typer.Context) -> None:
    """Prevent further experiments from starting; a running one continues."""
    with robot_of(context).service("queue") as robot:
        _print_status(robot.queue.pause())


@app.command()
def resume(context: typer.Context, yes: YesOption = False) -> None:
    """Let the queue move the arm again. LOOK AT THE ARM FIRST: waiting experiments start."""
    from daq_cli.robot.remote.connection import connected_status, require_consent

    with robot_of(context).service("queue") as robot:
        real = require_consent(connected_status(robot), ConsentPrompt(yes))
        _print_status(robot.queue.resume(moves_real_arm=real))


@app.command()
def schedules(context: typer.Context, json: JsonOption = False) -> None:
    """List schedules, the newest first. `daq run … --daily 02:00` adds one."""
    with robot_of(context).service("queue") as robot:
        found = list(robot.schedules.list())
    if json:
        print_json([one.model_dump(mode="json") for one in found])
        return
    if not found:
        print("no schedules: `daq run … --daily 02:00` makes one")
    for one in found:
        when = f"every {one.every:g} s" if one.every is not None else f"{one.cron} ({one.zone})"
        coming = "off or complete" if one.next is None else f"next on {one.next.astimezone():%Y-%m-%d at %H:%M %Z}"
        coming = f"BROKEN: {one.problem}" if one.problem else coming
        print(f"{one.id}  {_name(one)}, by {one.created_by}: {when}; {one.submitted_runs} runs, {coming}{_review(one)}")


@app.command()
def unschedule(
    context: typer.Context, schedule: Annotated[str, typer.Argument(help="Number, as `queue schedules` prints it.")]
) -> None:
    """Delete a schedule. Its experiments that wait or have run are kept."""
    with robot_of(context).service("queue") as robot:
        robot.schedules.delete(schedule)
    print(f"schedule {schedule} deleted")


def _name(experiment: Experiment | Schedule) -> str:
    return experiment.spec.name or experiment.spec.trajectory.kind


def _review(experiment: Experiment | Schedule) -> str:
    """Returns the part of a line about an experiment's approval."""
    if experiment.needs_approval_of is not None:
        who = "an operator" if experiment.needs_approval_of == "operator" else "an owner of the robot"
        return f", not approved yet by {who} who did not submit it"
    return "" if experiment.approval is None else f", approved by {experiment.approval.by}"


def _print_status(status: QueueStatus) -> None:
    state = f"paused: {status.reason}" if status.paused else f"open: {status.reason}"
    print(f"{state}; {status.queued} waiting" + (f"; {status.running} runs" if status.running else ""))
    if status.waiting_for:
        print(f"waiting for {status.waiting_for}")
