"""`daq follow`: runs set points with which the arm follows a motion, from a model or corrected by a trace's error."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from daq.contracts.errors import TraceError
from daq_cli.app import completion
from daq_cli.app.context import JsonOption, YesOption, console, print_json, print_table, printable
from daq_cli.commands.run import DryRunOption, FolderOption
from daq_cli.models.model_input import MODEL_HELP, read_model
from daq_cli.robot.access import robot_of
from daq_cli.robot.experiment import RunOptions, carry_out, read_spec
from model.units import joint_unit, shown_unit, with_unit

if TYPE_CHECKING:
    from rich.table import Table

    from daq.contracts.experiment import ExperimentSpec, Feedforward, TrackingError
    from daq.contracts.machine import Machine
    from daq.contracts.trace import Trace
    from daq_cli.robot.operations import RobotAccess

app = typer.Typer(add_completion=False, help="Follow a motion closely.", no_args_is_help=True)

TraceArgument = Annotated[
    str,
    typer.Argument(
        help="A file, the first characters of a trace's ID or name, or `last`.", autocompletion=completion.traces
    ),
]


@app.command("run")
def by_model(
    context: typer.Context,
    experiment: Annotated[
        str, typer.Argument(help="A preset, an experiment's file (.json, .toml), or a trace of the motion.")
    ],
    model: Annotated[str, typer.Option("--model", "-m", help=MODEL_HELP)],
    folder: FolderOption = None,
    dry_run: DryRunOption = False,
    yes: YesOption = False,
    json: JsonOption = False,
) -> None:
    """Run an experiment with set points that a model computes."""
    from daq.safety.planned import planned
    from daq_cli.app.progress import shown_progress
    from extras.motion.inverse import feedforward

    robot = robot_of(context)
    machine, known = robot.machine, read_model(model)
    asked = _experiment(robot, folder, experiment)
    with shown_progress("computing set points") as progress:
        found = feedforward(known, asked, machine, lambda spec: planned(spec, machine), progress)
    _carry_out(robot, found, RunOptions(folder, dry_run, yes, json))


@app.command("learn")
def from_trace(
    context: typer.Context,
    trace: TraceArgument = "last",
    model: Annotated[
        str | None,
        typer.Option(
            "--model", "-m", help="Model of the arm's response to set points (default: estimated from the trace)."
        ),
    ] = None,
    share: Annotated[float, typer.Option(min=0.01, max=1.0, help="Share of the correction to apply.")] = 1.0,
    folder: FolderOption = None,
    dry_run: DryRunOption = False,
    yes: YesOption = False,
    json: JsonOption = False,
) -> None:
    """Run the motion of a trace again, with set points corrected by its tracking error."""
    from daq.safety.planned import planned
    from extras.motion.learning import learn

    robot = robot_of(context)
    machine, known = robot.machine, None if model is None else read_model(model)
    found = learn(_trace(robot, folder, trace), machine, lambda spec: planned(spec, machine), known, share)
    _carry_out(robot, found, RunOptions(folder, dry_run, yes, json))


@app.command()
def show(
    context: typer.Context, trace: TraceArgument = "last", folder: FolderOption = None, json: JsonOption = False
) -> None:
    """Show the tracking error of a trace, by joint: before, expected and reached."""
    from daq.safety.planned import motion_of
    from extras.motion.tracking import followed

    found = _trace(robot_of(context), folder, trace)
    spec, machine = found.record.spec, found.record.machine
    reached = None if machine is None else followed(found, lambda asked: motion_of(asked, machine))
    if spec is None or machine is None or reached is None:
        raise TraceError(_of_no_experiment(found))
    rows = _rows(spec.feedforward, machine, reached.errors)
    if json:
        print_json({"trace": found.record.trace_id, "tracking": rows})
        return
    if spec.feedforward is not None:
        print(printable(expectation(spec.feedforward)))
    print_table(_table(rows, spec.feedforward))


def _carry_out(robot: RobotAccess, found: ExperimentSpec, options: RunOptions) -> None:
    """Prints the expected error, and runs the experiment."""
    assert found.feedforward is not None
    console().print(expectation(found.feedforward))
    console().print(_table(_rows(found.feedforward, robot.machine), found.feedforward))
    carry_out(robot, found, options)


def _trace(robot: RobotAccess, folder: Path | None, name: str) -> Trace:
    from daq.traces.reader import read_trace

    return read_trace(robot.find_trace(folder or robot.call.trace_folder, name), robot.call.trace_limits)


def _experiment(robot: RobotAccess, folder: Path | None, name: str) -> ExperimentSpec:
    """Returns the plain experiment that an argument names. Raises SpecError, TraceError."""
    from daq.trajectories.presets import PRESETS

    if name in PRESETS:
        return PRESETS[name].spec
    if Path(name).suffix.lower() in (".json", ".toml"):
        return read_spec(Path(name)).wanted_motion
    trace = _trace(robot, folder, name)
    if trace.record.spec is None:
        raise TraceError(_of_no_experiment(trace))
    return trace.record.spec.wanted_motion


def _of_no_experiment(trace: Trace) -> str:
    return f"trace {trace.record.trace_id}: does not state its experiment"


def expectation(source: Feedforward) -> str:
    """Returns a line on the origin of the set points, above the table of errors."""
    by = [f"computed with model {source.model}"] if source.model else []
    by += [f"learned from trace {source.learned_from}"] if source.learned_from else []
    motion = source.asked.trajectory.kind.replace("_", " ")
    return f"set points {' and '.join(by)}, to follow the {motion}; tracking error, rms (largest):"


def _rows(
    source: Feedforward | None, machine: Machine, reached: Mapping[int, TrackingError] | None = None
) -> list[dict[str, object]]:
    """Returns errors of each joint in degrees (mm for a sliding joint): before, expected and reached, as far as
    known."""
    found = []
    known: dict[str, Mapping[int, TrackingError]] = {}
    known |= {} if source is None else {"before": source.before, "expected": source.expected}
    known |= {} if reached is None else {"reached": reached}
    for joint in list(known.values())[-1]:
        scale, unit = shown_unit(joint_unit(machine, joint))
        row: dict[str, object] = {"joint": joint, "unit": unit}
        for name, errors in known.items():
            error = errors.get(joint)
            row[name] = None if error is None else {"rms": scale * error.rms, "largest": scale * error.largest}
        found.append(row)
    return found


def _table(rows: list[dict[str, Any]], source: Feedforward | None) -> Table:
    from rich.table import Table

    before = "in that trace" if source is not None and source.learned_from else "plain set points"
    titles = {"before": before, "expected": "expected", "reached": "reached"}
    told = [name for name in titles if name in rows[0]]
    table = Table(box=None, header_style="bold")
    for title in ("joint", *(titles[name] for name in told)):
        table.add_column(title, justify="right")
    for row in rows:
        table.add_row(str(row["joint"]), *(_cell(row[name], row["unit"]) for name in told))
    return table


def _cell(error: dict[str, float] | None, unit: str) -> str:
    return "–" if error is None else f"{with_unit(format(error['rms'], '.3f'), unit)} ({error['largest']:.2f})"
