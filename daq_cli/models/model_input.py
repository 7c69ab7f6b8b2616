"""Reads the models, machines and traces that the command line names."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from daq.contracts.errors import SpecError
from daq.contracts.machine import Machine, load_machine, shipped_machines
from daq_cli.app import completion
from daq_cli.app.context import console, printable
from daq_cli.app.output_file import check_folder

if TYPE_CHECKING:
    from daq.contracts.trace import Trace
    from daq_cli.robot.operations import RobotAccess
    from model.machine_model.model import Model

TracesArgument = Annotated[
    list[str],
    typer.Argument(
        help="Files (.mcap, .csv), beginnings of traces' numbers or names, or `last`.", autocompletion=completion.traces
    ),
]
TraceFolderOption = Annotated[Path | None, typer.Option(help="Folder of traces (default: the configured one).")]


def _page(path: Path | None) -> Path | None:
    """Rejects an unsuitable or unwritable file before the computation."""
    if path is not None:
        if path.suffix != ".html":
            raise SpecError(f"report {path}: must be an .html file")
        check_folder(path, "report")
    return path


ReportOption = Annotated[
    Path | None, typer.Option("--report", callback=_page, help="Write a report as one self-contained .html file.")
]


def _model_file(path: Path | None) -> Path | None:
    """Rejects an unsuitable or unwritable file before the computation."""
    if path is not None:
        if path.suffix != ".json":
            raise SpecError(f"--out {path}: a model is written as .json")
        check_folder(path, "--out")
    return path


OutOption = typer.Option("--out", "-o", callback=_model_file, help="File for the resulting model (.json).")
HoldoutOption = Annotated[
    list[str] | None,
    typer.Option(
        "--holdout",
        help="A held-out trace, used to judge and not to fit. May be repeated.",
        autocompletion=completion.traces,
    ),
]
JudgedByOption = Annotated[
    list[str] | None,
    typer.Option(
        "--holdout",
        help="A held-out trace: it judges what the others show. Where torques are compared, it is fitted to in turn "
        "while they judge. May be repeated.",
        autocompletion=completion.traces,
    ),
]

EffectFileOption = Annotated[
    list[Path] | None,
    typer.Option("--effect-file", help="An effect of your own (.py, docs/own-effect.md). May be repeated."),
]


class Comparison(StrEnum):
    """How a diagnosis compares model and records."""

    OUTPUT_ERROR = "output-error"
    INVERSE_DYNAMICS = "inverse-dynamics"


ComparisonOption = Annotated[
    Comparison | None,
    typer.Option(
        "--method",
        help="Simulate the closed loop (output-error), or balance torques along the recorded motion "
        "(inverse-dynamics). Default: as machine and traces allow.",
    ),
]
MostOption = Annotated[
    int | None,
    typer.Option(
        "--most",
        min=1,
        max=10,
        help="Largest number of effects to add, one after the other (default: 3; of torques 8).",
    ),
]

CandidatesOption = Annotated[
    str | None,
    typer.Option(
        "--effects",
        help="Candidate effects, such as backlash,coulomb (default: every effect of the library).",
        autocompletion=completion.effects,
    ),
]

ExaminedOption = Annotated[
    str | None,
    typer.Option(
        "--joints", help="Examine these joints only: 1-3, 2 (default: all).", autocompletion=completion.joints
    ),
]

MODEL_HELP = "A model (.json, as `daq fit` writes it), a machine file (.toml), or a machine that ships (ma2000)."


def read_model(name: str) -> Model:
    """Returns the model of a .json file, or of a machine with the friction in its file.

    Raises a one-line SpecError.
    """
    from model.machine_model.model import base_model
    from model.machine_model.model_file import load_model

    path = Path(name)
    if name in shipped_machines() or path.suffix == ".toml" or not (path.suffix or path.exists()):
        return base_model(load_machine(name))
    return load_model(path)


def load_effects(files: Sequence[Path] | None, robot: RobotAccess | None = None) -> None:
    """Loads user-defined effects from files on the command line. Raises a one-line SpecError.

    Args:
        robot: where the effects are to be used, if that may be at a service, which never runs uploaded programs.
    """
    if files:
        if robot is not None:
            robot.require_local(
                "--effect-file: a service runs no programs that it is sent; fetch the traces and compute here"
            )
        from model.effects.library import load_effect_file

        for file in files:
            load_effect_file(file)


def model_label(name: str) -> str:
    """Returns the name of a model in tables: its file name, or the machine's name."""
    return Path(name).stem


def model_labels(names: Sequence[str]) -> list[str]:
    """Returns distinct labels of models: full names if the file names are equal."""
    labels = [model_label(name) for name in names]
    return labels if len(set(labels)) == len(labels) else list(names)


def read_traces(robot: RobotAccess, folder: Path | None, names: Sequence[str]) -> list[Trace]:
    """Returns traces by file, ID, name or `last`. CSV files are read directly; missing data are reported.

    Raises TraceError, SpecError.
    """
    from daq.contracts.trace import INCOMPLETE
    from daq.traces.files import open_trace

    call = robot.call
    place = folder or call.trace_folder
    if not names:
        raise SpecError("no traces named: at least one is needed")
    found = []
    for name in names:
        path = robot.find_trace(place, name)
        trace = replace(open_trace(path, call.trace_limits), file=name if Path(name).exists() else path.name)
        if INCOMPLETE in trace.record.notes:
            console().print(printable(f"{trace.file}: {trace.record.notes}"))
        found.append(trace)
    return found


def files_of(traces: Sequence[Trace]) -> dict[str, str]:
    """Returns the file names of traces as on the command line, by trace ID."""
    return {trace.record.trace_id: trace.file for trace in traces if trace.file}


def machine_of(traces: Sequence[Trace], robot: RobotAccess, names: Sequence[str] = ()) -> Machine:
    """Returns the machine that recorded the traces; if they name none, the configured one, which is then announced.

    Limits may differ: those of the last trace are used.

    Args:
        names: the traces as on the command line, in order; without them, their IDs.

    Raises SpecError if the machines differ otherwise, and for a trace without a machine that lacks a joint.
    """
    # imported here: numpy takes long to load, and completion does not need it
    from daq.contracts.joint_matching import matched

    machines = [t.record.machine for t in traces if t.record.machine is not None]
    called = list(dict.fromkeys(machine.name for machine in machines))
    if len(called) > 1:
        raise SpecError(f"the traces were made on different machines: {', '.join(called)}; one at a time")
    for machine in machines[1:]:
        if place := _difference(_described(machines[0]), _described(machine)):
            raise SpecError(
                f"the traces were made on different machines that are both called {machine.name}: {place} differs; "
                "one at a time, or name the machine or model to use"
            )
    taken = machines[-1] if machines else robot.machine
    named = zip(_names(traces, names), traces, strict=True)
    unnamed = [(name, matched(trace, taken)) for name, trace in named if trace.record.machine is None]
    for name, trace in unnamed:
        if max(trace.joints) > len(taken.joints):
            raise SpecError(f"{name}: {_surplus(trace, taken)}; name its machine or model with --model")
        if lacking := [joint for joint in taken.modelled_joints if joint not in trace.joints]:
            raise SpecError(
                f"{name}: names no machine, and has no joint {_listed(lacking)} of {taken.name}, "
                f"{'that of the other traces' if machines else 'the configured one'}; name its machine or model with "
                "--model"
            )
    if unnamed and not machines:
        files = ", ".join(name for name, _ in unnamed)
        console().print(f"{files}: no machine is named there: taken for the configured {taken.name} (else say --model)")
    return taken


def check_made_for(machine: Machine, traces: Sequence[Trace], names: Sequence[str]) -> None:
    """Raises SpecError, which names the file as on the command line, for a trace that cannot be of this machine."""
    from daq.contracts.joint_matching import matched

    speeds = [j for j in machine.modelled_joints if (s := machine.joint(j).sensor) and s.measures == "velocity"]
    for name, read in zip(_names(traces, names), traces, strict=True):
        own = read.record.machine
        if own is not None and own.name != machine.name:
            raise SpecError(f"{name}: was made on {own.name}, the model describes {machine.name}")
        trace = matched(read, machine)
        if max(trace.joints) > len(machine.joints):
            raise SpecError(
                f"{name}: {_surplus(trace, machine)}; is it of another machine? `traces import --joints` chooses some"
            )
        if lacking := [joint for joint in machine.modelled_joints if joint not in trace.joints]:
            raise SpecError(
                f"{name}: has no joint {_listed(lacking)}, which the model of {machine.name} moves; it has "
                f"{', '.join(map(str, trace.joints))}"
            )
        if speeds and trace.velocity is None:
            raise SpecError(
                f"{name}: has no velocity, which the sensors of {machine.name} measure; is it of another machine?"
            )


def _surplus(trace: Trace, machine: Machine) -> str:
    count = len(machine.joints)
    return f"has a joint {max(trace.joints)}, and {machine.name} has {count} joint{'' if count == 1 else 's'}"


def _names(traces: Sequence[Trace], names: Sequence[str]) -> list[str]:
    return list(names) if names else [t.called for t in traces]


def _listed(joints: Sequence[int]) -> str:
    return " or ".join(map(str, joints))


def _described(machine: Machine) -> dict[str, Any]:
    """The physical description of a machine, without its title, notes, limits and rest posture."""
    return machine.model_dump(exclude={"title", "notes", "limits", "rest_posture"})


def _difference(one: Any, other: Any, place: str = "") -> str:
    """The first place where two descriptions differ, such as `joints.2.link.mass.value`; empty if they are equal.
    Sources of numbers may differ."""
    if isinstance(one, tuple) and isinstance(other, tuple) and len(one) == len(other):
        one, other = dict(enumerate(one, start=1)), dict(enumerate(other, start=1))
    if isinstance(one, dict) and isinstance(other, dict):
        keys = [key for key in one | other if key != "source"]
        found = (_difference(one.get(key), other.get(key), f"{place}.{key}".lstrip(".")) for key in keys)
        return next((where for where in found if where), "")
    return "" if one == other else place
