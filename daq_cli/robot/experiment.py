"""An experiment from the command line: its preview, its run, and its result."""

from __future__ import annotations

import re
import shlex
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from daq.contracts import exit_codes
from daq.contracts.errors import OrderFailedError, SafetyError, SpecError
from daq_cli.app.consent import ConsentPrompt
from daq_cli.app.context import print_json

if TYPE_CHECKING:
    from daq.contracts.experiment import ExperimentSpec
    from daq.contracts.machine import Machine
    from daq.owner.messages import Finished
    from daq_cli.robot.operations import RobotAccess


@dataclass(frozen=True)
class RunOptions:
    """Options shared by every command that runs an experiment."""

    folder: Path | None
    dry_run: bool
    yes: bool
    json: bool
    cron: str | None = None
    """Cron schedule of repeated runs by a service; None for a run now."""


def read_spec(path: Path) -> ExperimentSpec:
    """Returns the experiment in a .json or .toml file. Raises a one-line SpecError."""
    from daq.contracts.documents import read_document
    from daq.contracts.experiment import parse_spec

    what = f"experiment {path}"
    return parse_spec(read_document(path, what), what)


def carry_out(robot: RobotAccess, spec: ExperimentSpec, options: RunOptions) -> None:
    """Runs `spec` with these options, prints the result and, unless it is complete, ends with its exit code."""
    if options.dry_run:
        preview(spec, robot.machine, options.json)
        return
    if options.cron is not None:
        _schedule(robot, spec, options.cron, as_json=options.json)
        return
    folder = options.folder or robot.call.trace_folder
    finished = robot.acquire(spec, robot.machine, folder, ConsentPrompt(options.yes))
    if options.json:
        print_json(finished.model_dump(mode="json"))
    else:
        print_result(finished, server=robot.call.server)
    if finished.outcome != "complete":
        raise typer.Exit(exit_codes.OF_OUTCOME[finished.outcome])


def cron_of(daily: str | None, cron: str | None) -> str | None:
    """Returns the cron expression of `--daily HH:MM` or `--cron`; None without either. Raises SpecError."""
    if daily is None:
        return cron
    if cron is not None:
        raise SpecError("--daily and --cron: give one of them")
    found = re.fullmatch(r"([01]?\d|2[0-3]):([0-5]\d)", daily, re.ASCII)
    if found is None:
        raise SpecError(f"--daily {daily!r:.40}: is no time of a day; write 00:00 to 23:59")
    return f"{int(found[2])} {int(found[1])} * * *"


def _schedule(robot: RobotAccess, spec: ExperimentSpec, cron: str, *, as_json: bool) -> None:
    """Makes the service run `spec` at the times of `cron`, in the time zone of its computer. Moves nothing now."""
    with robot.service("run --daily or --cron") as service:
        made = service.schedules.create(spec, cron=cron)
    if as_json:
        print_json(made.model_dump(mode="json"))
        return
    first = "" if made.next is None else f"; first on {made.next.astimezone():%Y-%m-%d at %H:%M %Z}"
    _, _, day, _, weekday = cron.split()
    either = "" if "*" in (day[0], weekday[0]) else f", on days {day} of the month and on every weekday {weekday}"
    when = f"{made.cron} ({made.zone}){either}{first}"
    print(f"schedule {made.id}: {when}. `daq queue schedules` lists, `unschedule` cancels")


def acquire_complete(
    robot: RobotAccess, spec: ExperimentSpec, machine: Machine, folder: Path, consent: ConsentPrompt
) -> Finished:
    """Runs `spec` if the complete record is required. Raises OrderFailedError for an incomplete one, too."""
    finished = robot.acquire(spec, machine, folder, consent)
    if finished.outcome != "complete":
        why = f"{finished.outcome}: {finished.reason}" if finished.reason else finished.outcome
        code = exit_codes.OF_OUTCOME[finished.outcome]
        raise OrderFailedError(f"{why}; the run is not complete, so its trace is not used", code)
    return finished


def preview(spec: ExperimentSpec, machine: Machine, as_json: bool) -> None:
    """Prints the planned motion and the limits that it violates. Raises SafetyError if it violates any."""
    from daq.contracts.joint_text import position_text, speed_text
    from daq.safety import check_plan, unchecked
    from daq.trajectories.planner import plan, start_angles

    motion = plan(spec, machine, start_angles(spec, machine))
    shown = motion.preview()
    violations = check_plan(motion, machine, machine.limits)
    if as_json:
        found = {"preview": shown.as_data(), "violations": [str(v) for v in violations]}
        computed = {} if spec.feedforward is None else {"experiment": spec.model_dump(mode="json")}
        print_json(found | computed)
    else:
        every = f"every {shown.period * 1e3:g} ms"
        print(f"{spec.trajectory.kind}: {shown.duration:.2f} s, {shown.set_points} set points {every}")
        for joint in shown.joints:
            if joint.moves:
                ends = joint.start, joint.end, joint.lowest, joint.highest
                start, end, low, high = (position_text(machine, joint.joint, one) for one in ends)
                top = speed_text(machine, joint.joint, joint.top_speed)
                print(f"  joint {joint.joint}: {start} → {end}, between {low} and {high}, at most {top}")
        for line in unchecked(machine, machine.limits):
            print(f"  {line}")
    if violations:
        raise SafetyError(f"refused: {'; '.join(map(str, violations))}")
    if not as_json:
        print("  no limit is violated; nothing was sent")


def print_result(finished: Finished, pictures: Sequence[Path] = (), server: str | None = None) -> None:
    """Prints the result of a run for people: how it ended, its figures, its pictures, and the next command.

    Args:
        server: URL of the service that made the run; None for a local robot.
    """
    # imports numpy, which completion does not need
    from daq.contracts.trace import LATE_SET_POINTS, late_set_points_line
    from daq.traces.reader import read_trace
    from daq_cli.robot.seen import print_figures

    counters = finished.counters
    why = f" — {finished.reason}" if finished.reason else ""
    print(f"{finished.outcome}: {finished.samples} samples, {finished.missing} missing{why}")
    shown = ("retries", "damaged", "torn", "missed_set_points", "restarts")
    late = counters.get(LATE_SET_POINTS)
    if late is None:
        print("set points taken a period late: not known, for not every control period has a sample")
    elif late:
        print(late_set_points_line(late))
    print("link: " + ", ".join(f"{name.replace('_', ' ')} {counters.get(name, 0):.0f}" for name in shown))
    print(f"trace: {finished.trace}")
    print_figures(read_trace(finished.trace))
    trace = shlex.quote(str(finished.trace))
    for picture in pictures:
        print(f"picture: {picture}")
    if not pictures:
        print(f"picture: daq traces plot {trace}")
    print(f"next:    daq fit {trace} -o model.json")
    print("         daq serve    # the same in a browser" if server is None else f"         {server}/#/traces")
