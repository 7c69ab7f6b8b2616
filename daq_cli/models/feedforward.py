"""Set points that make the arm follow a motion, computed before a run: `daq run … --feedforward`, `--learn-from`."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from daq_cli.app.context import console, print_table, printable
from daq_cli.robot.experiment import Computation, RunOptions
from model.units import joint_unit, shown_unit, with_unit

if TYPE_CHECKING:
    from rich.table import Table

    from daq.contracts.experiment import ExperimentSpec, Feedforward, TrackingError
    from daq.contracts.machine import Machine
    from daq.contracts.trace import Trace
    from daq_cli.robot.operations import RobotAccess


def with_computed_set_points(
    robot: RobotAccess, asked: ExperimentSpec, computation: Computation, options: RunOptions
) -> ExperimentSpec:
    """The experiment with computed set points; says which error is expected. Raises SpecError, TraceError, SafetyError,
    each with one line."""
    from daq.safety.planned import planned
    from daq.traces.reader import read_trace
    from daq_cli.app.progress import shown_progress
    from daq_cli.models.model_input import read_model
    from model.feedforward.inverse import feedforward
    from model.feedforward.learning import learn

    machine = robot.machine
    model = None if computation.model is None else read_model(computation.model)
    with shown_progress("computing set points") as progress:
        if computation.learn_from is not None:
            file = robot.find_trace(options.folder or robot.call.trace_folder, computation.learn_from)
            trace = read_trace(file, robot.call.trace_limits)
            found = learn(trace, asked, machine, lambda spec: planned(spec, machine), model, computation.share)
        else:
            assert model is not None
            found = feedforward(model, asked, machine, lambda spec: planned(spec, machine), progress)
    assert found.feedforward is not None
    console().print(expectation(found.feedforward))
    console().print(_table(_rows(found.feedforward, machine), found.feedforward))
    return found


def expectation(source: Feedforward) -> str:
    """A line on where set points come from, above the table of errors."""
    by = [f"computed with model {source.model}"] if source.model else []
    by += [f"learned from trace {source.learned_from}"] if source.learned_from else []
    motion = source.asked.trajectory.kind.replace("_", " ")
    return f"set points {' and '.join(by)}, to follow the {motion}; tracking error, rms (largest):"


def tracking_data(trace: Trace) -> list[dict[str, object]] | None:
    """The tracking error of each joint of a trace with computed set points: reached, expected, and before, in degrees
    (mm where a joint slides); None for other traces."""
    spec = trace.record.spec
    if spec is None or spec.feedforward is None or trace.record.machine is None:
        return None
    from daq.contracts.errors import DaqError
    from daq.safety.planned import motion_of
    from model.feedforward.tracking import followed

    machine = trace.record.machine
    try:
        found = followed(trace, lambda asked: motion_of(asked, machine))
    except DaqError:
        return None
    return None if found is None else _rows(spec.feedforward, machine, found.errors)


def print_tracking(trace: Trace) -> None:
    """Where the set points come from, and expected beside reached error; nothing for other traces."""
    spec, rows = trace.record.spec, tracking_data(trace)
    if rows is not None and spec is not None and spec.feedforward is not None:
        print(printable(expectation(spec.feedforward)))
        print_table(_table(rows, spec.feedforward))


def _rows(
    source: Feedforward, machine: Machine, reached: Mapping[int, TrackingError] | None = None
) -> list[dict[str, object]]:
    found = []
    for joint in source.expected if reached is None else reached:
        scale, unit = shown_unit(joint_unit(machine, joint))
        row: dict[str, object] = {"joint": joint, "unit": unit}
        errors = {"before": source.before.get(joint), "expected": source.expected.get(joint)}
        errors |= {} if reached is None else {"reached": reached[joint]}
        for name, error in errors.items():
            row[name] = None if error is None else {"rms": scale * error.rms, "largest": scale * error.largest}
        found.append(row)
    return found


def _table(rows: list[dict[str, Any]], source: Feedforward) -> Table:
    from rich.table import Table

    before = "in that trace" if source.learned_from else "plain set points"
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
