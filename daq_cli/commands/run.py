"""`daq run`: one subcommand per kind of trajectory, with options made from its fields."""

from __future__ import annotations

import inspect
import math
from collections.abc import Callable
from pathlib import Path
from types import NoneType
from typing import TYPE_CHECKING, Annotated, Any, get_args

import typer
from pydantic import BaseModel
from pydantic.fields import FieldInfo

from daq.contracts import experiment
from daq.contracts.errors import SpecError
from daq.contracts.experiment import ExperimentSpec, parse_joints, parse_spec
from daq_cli.app import completion
from daq_cli.app.context import JsonOption, YesOption, invocation, print_json
from daq_cli.app.quantities import parse_angle, parse_gains, parse_per_joint_angles, require_units
from daq_cli.robot.access import robot_of
from daq_cli.robot.experiment import RunOptions, carry_out, cron_of

if TYPE_CHECKING:
    from daq.contracts.machine import Machine

app = typer.Typer(add_completion=False, help="Run an experiment and record its trace.", no_args_is_help=True)

KINDS: dict[str, type[BaseModel]] = {
    "ramp": experiment.Ramp,
    "step": experiment.Step,
    "staircase": experiment.Staircase,
    "slow-ramp": experiment.SlowRamp,
    "sine": experiment.Sine,
    "multisine": experiment.Multisine,
    "cubic": experiment.Cubic,
    "via": experiment.Via,
    "pick-and-place": experiment.PickAndPlace,
}
_IN_SHORT = {
    "ramp": "Equal increments, all joints arriving together.",
    "step": "The whole amplitude in one set point.",
    "staircase": "Equal steps up, and down again.",
    "slow-ramp": "Constant low speed, with reversals.",
    "sine": "A sine about the start posture.",
    "multisine": "Many sines at once, with seeded phases.",
    "cubic": "Cubic in time, at rest at both ends.",
    "via": "Cubic segments through via points.",
    "pick-and-place": "4-3-4: lifted off, over, and set down.",
}
_HELP = {
    "duration": "Duration of the motion in s.",
    "period": "Period of the sine in s.",
    "dwell": "Time on each step in s.",
    "steps": "Number of steps one way.",
    "back": "Go down again afterwards.",
    "reversals": "Number of changes of direction.",
    "cycles": "Number of periods of the sine.",
    "lowest": "Lowest frequency in Hz.",
    "highest": "Highest frequency in Hz.",
    "tones": "Number of sines.",
    "seed": "Seed of the phases.",
    "lift": "Height of the lift-off and set-down points above the ends in m.",
    "pick": "Time up to the lift-off point in s.",
    "travel": "Time from the lift-off to the set-down point in s.",
    "place": "Time down from the set-down point in s.",
}
_ANGLES = {"phase": "degrees", "speed": "degrees/s"}

JointsOption = Annotated[str, typer.Option(help="Joints that move: 1-3, 1,3 or 2.", autocompletion=completion.joints)]
StartOption = Annotated[str | None, typer.Option(help="Start angles, such as 1=180,2=45 (degrees), or 1=30mm.")]
GainsOption = Annotated[str | None, typer.Option(help="Gains P/I/D, such as 1=2/0/0,2=2/0/0 (each 0-20).")]
SettleOption = Annotated[float, typer.Option(help="Time at rest before the motion in s, recorded.")]
HoldOption = Annotated[float, typer.Option(help="Time at rest after the motion in s, recorded.")]
RepeatsOption = Annotated[int, typer.Option(help="Number of times that the motion is made.")]
RecordOption = Annotated[str | None, typer.Option(help="Joints to record (default: as many as the line has room for).")]
NameOption = Annotated[str | None, typer.Option(help="A name for the experiment.")]
OperatorOption = Annotated[str | None, typer.Option(help="Who runs it.")]
NotesOption = Annotated[str, typer.Option(help="Remarks that are kept with the trace.")]
FolderOption = Annotated[Path | None, typer.Option(help="Folder for the trace (default: the configured one).")]
DailyOption = Annotated[
    str | None, typer.Option("--daily", help="Have the server run it every day at this time of its clock: 02:00.")
]
CronOption = Annotated[
    str | None, typer.Option("--cron", help="The same by minute, hour, day, month, weekday: '0 2 * * 1-5'.")
]
DryRunOption = Annotated[bool, typer.Option("--dry-run", help="Only check and show the motion; connect to nothing.")]

COMMON: dict[str, tuple[Any, Any]] = {
    "joints": (JointsOption, "1-3"),
    "start": (StartOption, None),
    "gains": (GainsOption, None),
    "settle": (SettleOption, 0.5),
    "hold": (HoldOption, 2.0),
    "repeats": (RepeatsOption, 1),
    "record": (RecordOption, None),
    "name": (NameOption, None),
    "operator": (OperatorOption, None),
    "notes": (NotesOption, ""),
}
EXECUTION: dict[str, tuple[Any, Any]] = {
    "folder": (FolderOption, None),
    "daily": (DailyOption, None),
    "cron": (CronOption, None),
    "dry_run": (DryRunOption, False),
    "yes": (YesOption, False),
    "json": (JsonOption, False),
}


def _option(name: str, field: FieldInfo) -> tuple[Any, Any]:
    """Type and default of the option for a field of a trajectory."""
    default = field.get_default()
    if name == "amplitude":
        return Annotated[
            str,
            typer.Option(help="Amplitude in degrees (a sliding joint: 30mm), or one for each joint: 1=21.6,2=-10."),
        ], f"{_degrees(default)}"
    if name == "points":
        text = "Points in degrees from the start, one after the other: 10;20 or, for each joint, 1=10,2=5;1=20,2=0."
        return Annotated[str, typer.Option(help=text)], inspect.Parameter.empty
    if name == "times":
        return Annotated[
            str, typer.Option(help="Times in s at which the points are passed: 1,2.5.")
        ], inspect.Parameter.empty
    if name in _ANGLES:
        return Annotated[str, typer.Option(help=f"{name.capitalize()} in {_ANGLES[name]}.")], f"{_degrees(default)}"
    kind = field.annotation
    if NoneType in get_args(kind):
        raise TypeError(f"trajectory field {name}: optional fields have no option")
    return Annotated[kind, typer.Option(help=_HELP.get(name, ""))], default


def _degrees(radians: float) -> float:
    return round(math.degrees(radians), 6)


def _trajectory(kind: type[BaseModel], values: dict[str, Any]) -> dict[str, Any]:
    data: dict[str, Any] = {"kind": kind.model_fields["kind"].default}
    for name in kind.model_fields:
        if name == "amplitude":
            data[name] = parse_per_joint_angles(values[name], name)
        elif name == "points":
            data[name] = [parse_per_joint_angles(point, "point") for point in values[name].split(";")]
        elif name == "times":
            data[name] = [part.strip() for part in values[name].split(",")]
        elif name in _ANGLES:
            data[name] = parse_angle(values[name].removesuffix("/s"), name)
        elif name != "kind":
            data[name] = values[name]
    return data


def _spec_from_options(trajectory: dict[str, Any], values: dict[str, Any], operator: str | None) -> ExperimentSpec:
    data: dict[str, Any] = {"trajectory": trajectory, "joints": parse_joints(values["joints"])}
    if values["start"] is not None:
        start = parse_per_joint_angles(values["start"], "start")
        if not isinstance(start, dict):
            raise SpecError(f"start {values['start']!r}: write joint=angle pairs like 1=180,2=45")
        data["start"] = start
    if values["gains"] is not None:
        data["gains"] = parse_gains(values["gains"])
    if values["record"] is not None:
        data["record"] = parse_joints(values["record"])
    for name in ("settle", "hold", "repeats", "name", "notes"):
        data[name] = values[name]
    data["operator"] = values["operator"] or operator
    return parse_spec(data)


def _require_units(trajectory: dict[str, Any], start: str | None, machine: Machine, joints: tuple[int, ...]) -> None:
    """Raises SpecError if a typed unit is that of another kind of joint."""
    for name in ("amplitude", "speed"):
        if name in trajectory:
            require_units(name, trajectory[name], machine, joints)
    for point in trajectory.get("points", ()):
        require_units("points", point, machine, joints)
    if start is not None:
        require_units("start", parse_per_joint_angles(start, "start"), machine, joints)


def spec_of(
    kind: type[BaseModel], values: dict[str, Any], operator: str | None, machine: Callable[[], Machine]
) -> ExperimentSpec:
    """Returns the experiment that the options of `daq run KIND` describe. Raises SpecError, also for a typed unit that
    is not that of the joint."""
    trajectory = _trajectory(kind, values)
    spec = _spec_from_options(trajectory, values, operator)
    _require_units(trajectory, values["start"], machine(), spec.joints)
    return spec


def _command(kind: type[BaseModel]) -> Callable[..., None]:
    """Returns the function of `daq run KIND`. typer reads its signature, which is made from the kind's fields."""

    def command(context: typer.Context, **values: Any) -> None:
        operator = invocation(context).configuration.operator
        spec = spec_of(kind, values, operator, lambda: robot_of(context).machine)
        cron = cron_of(values["daily"], values["cron"])
        options = RunOptions(values["folder"], values["dry_run"], values["yes"], values["json"], cron)
        carry_out(robot_of(context), spec, options)

    own = {name: _option(name, field) for name, field in kind.model_fields.items() if name != "kind"}
    options = {**own, **COMMON, **EXECUTION}
    parameters = [inspect.Parameter("context", inspect.Parameter.POSITIONAL_OR_KEYWORD, annotation=typer.Context)]
    parameters += [
        inspect.Parameter(name, inspect.Parameter.KEYWORD_ONLY, default=default, annotation=annotation)
        for name, (annotation, default) in options.items()
    ]
    command.__signature__ = inspect.Signature(parameters)  # type: ignore[attr-defined]
    command.__annotations__ = {p.name: p.annotation for p in parameters}
    command.__doc__ = kind.__doc__
    return command


for _name, _kind in KINDS.items():
    app.command(_name, short_help=_IN_SHORT[_name])(_command(_kind))


@app.command("spec")
def from_file(
    context: typer.Context,
    file: Annotated[Path, typer.Argument(help="An experiment as JSON or TOML, angles in rad.")],
    folder: FolderOption = None,
    daily: DailyOption = None,
    cron: CronOption = None,
    dry_run: DryRunOption = False,
    yes: YesOption = False,
    json: JsonOption = False,
) -> None:
    """Run an experiment from a file: any kind, also paths and sequences."""
    from daq_cli.robot.experiment import read_spec

    carry_out(robot_of(context), read_spec(file), RunOptions(folder, dry_run, yes, json, cron_of(daily, cron)))


@app.command("preset")
def by_name(
    context: typer.Context,
    name: Annotated[
        str, typer.Argument(help="Name of a preset; without one, all are listed.", autocompletion=completion.presets)
    ] = "",
    folder: FolderOption = None,
    daily: DailyOption = None,
    cron: CronOption = None,
    dry_run: DryRunOption = False,
    yes: YesOption = False,
    json: JsonOption = False,
) -> None:
    """Run an experiment by name, such as `diagnostic`; without a name, list the names."""
    from daq.trajectories.presets import PRESETS, preset

    if not name:
        if json:
            print_json([{"name": known, "description": one.description} for known, one in PRESETS.items()])
            return
        for known, one in PRESETS.items():
            print(f"{known:14s} {one.description}")
        return
    carry_out(robot_of(context), preset(name).spec, RunOptions(folder, dry_run, yes, json, cron_of(daily, cron)))


@app.command()
def diagnostic(
    context: typer.Context,
    folder: FolderOption = None,
    daily: DailyOption = None,
    cron: CronOption = None,
    dry_run: DryRunOption = False,
    yes: YesOption = False,
    json: JsonOption = False,
) -> None:
    """Run the preset `diagnostic`: about 55 s of motion that distinguishes hidden effects."""
    by_name(context, "diagnostic", folder, daily, cron, dry_run, yes, json)
