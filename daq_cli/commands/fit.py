"""`daq fit`: fits a model's parameters to traces, and names those that the traces do not determine."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from daq.contracts.errors import SpecError
from daq.contracts.machine import load_machine
from daq_cli.app import completion
from daq_cli.app.context import JsonOption, console, print_json, print_prose
from daq_cli.app.output_file import replacing
from daq_cli.models.effect_choice import bounds, patterns, with_effects
from daq_cli.models.model_input import (
    MODEL_HELP,
    EffectFileOption,
    HoldoutOption,
    OutOption,
    ReportOption,
    TraceFolderOption,
    TracesArgument,
    files_of,
    load_effects,
    machine_of,
    read_model,
    read_traces,
)
from daq_cli.models.parameter_table import print_on_the_edge, print_parameters, print_rows, print_undetermined
from daq_cli.models.record_doubts import DespiteDoubtsOption, end_if_doubted, print_record, stop_if_doubted
from daq_cli.models.service_jobs import NamedTraces, service_jobs
from daq_cli.robot.access import robot_of
from daq_cli.robot.operations import RobotAccess
from model.record_check.finding import doubts_in

if TYPE_CHECKING:
    from collections.abc import Sequence

    from daq.contracts.trace import Trace
    from model.base_parameters.result import BaseParameters
    from model.comparison.agreement import ModelAgreement
    from model.fitting.options import FitOptions
    from model.fitting.result import FitResult
    from model.machine_model.model import Model

app = typer.Typer(add_completion=False)

EffectsOption = Annotated[
    str | None,
    typer.Option(
        help="Effects besides rigid bodies and motors, such as viscous,coulomb:2-3, or none (default: the machine's).",
        autocompletion=completion.effects,
    ),
]
ParametersOption = Annotated[
    str | None,
    typer.Option(help="Parameters to fit: names or patterns such as *.mass,joint2.* (default: all uncertain ones)."),
]

HoldOption = Annotated[str | None, typer.Option(help="Parameters to hold at their values: names or patterns.")]
BoundOption = Annotated[
    list[str] | None,
    typer.Option(help="Bounds of a parameter, name=low:high, instead of the model's own. May be repeated."),
]
NoPriorsOption = Annotated[
    bool, typer.Option("--no-priors", help="Fit without the expected deviations of the parameters.")
]
MethodOption = Annotated[
    Literal["least_squares", "nelder_mead"],
    typer.Option(help="nelder_mead is the hill climbing of the 1991 source."),
]
SeedOption = Annotated[int, typer.Option(min=0, help="Seed of the starting values.")]
ConsistentOption = Annotated[
    bool,
    typer.Option(
        "--consistent-inertias", help="Find only bodies that can exist: mass and moments that some real body has."
    ),
]
OpenLoopOption = Annotated[
    bool, typer.Option("--open-loop", help="Apply the recorded drive instead of closing the loop.")
]


@app.command()
def fit(
    context: typer.Context,
    traces: TracesArgument,
    out: Annotated[Path, OutOption],
    model: Annotated[str | None, typer.Option(help=f"The model to start from. {MODEL_HELP}")] = None,
    machine: Annotated[
        str | None, typer.Option(help="Machine file or name of a machine (default: that of the traces).")
    ] = None,
    effects: EffectsOption = None,
    effect_file: EffectFileOption = None,
    parameters: ParametersOption = None,
    hold: HoldOption = None,
    bound: BoundOption = None,
    holdout: HoldoutOption = None,
    no_priors: NoPriorsOption = False,
    method: MethodOption = "least_squares",
    starts: Annotated[int, typer.Option(min=1, max=100, help="Number of fits from different starting values.")] = 1,
    seed: SeedOption = 0,
    open_loop: OpenLoopOption = False,
    consistent_inertias: ConsistentOption = False,
    torques: Annotated[
        bool,
        typer.Option(
            "--torques", help="Compare torques instead of motion: nothing is simulated, and the drive must be recorded."
        ),
    ] = False,
    report: ReportOption = None,
    folder: TraceFolderOption = None,
    despite_doubts: DespiteDoubtsOption = False,
    json: JsonOption = False,
) -> None:
    """Find the parameters with which a model best reproduces traces, and name those that the traces do not
    determine."""
    from model.fitting.options import FitOptions

    robot = robot_of(context)
    if torques:
        if method != "least_squares" or starts > 1 or seed or open_loop:
            raise SpecError(
                "--torques: --method, --starts, --seed and --open-loop need a fit of motion; leave them out"
            )
        robot.require_local("--torques: is computed here, not by a service; fetch the traces, then leave --server out")
    load_effects(effect_file, robot)
    fitted_to = read_traces(robot, folder, traces)
    held = read_traces(robot, folder, holdout or []) if holdout else []
    begin = _beginning(robot, fitted_to, model, machine, effects)
    options = FitOptions(
        parameters=patterns(parameters),
        held=patterns(hold) or (),
        bounds=bounds(bound or []),
        use_priors=not no_priors,
        method=method,
        starts=starts,
        seed=seed,
        loop="open" if open_loop else None,
        consistent_inertias=consistent_inertias,
    )
    if (jobs := service_jobs(robot)) is not None:
        named, held_out = NamedTraces(traces, fitted_to), NamedTraces(holdout or [], held)
        done = jobs.fit(begin, named, held_out, options, out, report)
        if despite_doubts or not doubts_in(done.record):
            _save(done, out, quiet=json)
        _print_result(done, done.models, out, as_json=json)
        end_if_doubted(done.record)
        return
    stop_if_doubted(begin, [*fitted_to, *held], despite_doubts=despite_doubts, as_json=json, torques=torques)
    if torques:
        from daq_cli.models.fit_torques import fit_recorded_torques

        fit_recorded_torques(begin, fitted_to, held, options, out, as_json=json, report=report)
    else:
        _fit_motion(begin, fitted_to, held, options, out, as_json=json, report=report)


def _fit_motion(
    begin: Model,
    traces: Sequence[Trace],
    held: Sequence[Trace],
    options: FitOptions,
    out: Path,
    *,
    as_json: bool,
    report: Path | None,
) -> None:
    """Fits motion on this computer, writes the model, and prints the result."""
    from daq_cli.app.progress import shown_progress
    from model.base_parameters.base_parameters import base_parameters
    from model.comparison.compare import compare
    from model.fitting.fit import fit as run_fit
    from model.simulation.prepared import Options

    with shown_progress("fitting") as progress:
        found = run_fit(begin, traces, options, lambda f, text: progress(0.9 * f, text))
        _save(found, out, quiet=as_json)
        comparison = compare(
            [("before", begin), ("fitted", found.model)],
            [*traces, *held],
            [t.record.trace_id for t in held],
            options=Options(loop=options.loop or "closed", quantise=False),
            progress=lambda f, text: progress(0.9 + 0.1 * f, text),
        )
    base = base_parameters(found.model, traces)
    _print_result(found, comparison.models, out, base, as_json=as_json)
    if report is not None:
        from model.reports.fit_report import fit_report
        from model.reports.page import write_report

        console().print(
            f"report: {write_report(fit_report(found, comparison, base, files_of([*traces, *held])), report)}"
        )
    end_if_doubted(found.record)


def _save(found: FitResult, out: Path, *, quiet: bool) -> None:
    """Writes the model and prints its file name before the comparison, which may fail."""
    with replacing(out) as part:
        found.save(part)
    if not quiet:
        console().print(f"model {found.model.identity}: {out}")


def _beginning(
    robot: RobotAccess, traces: Sequence[Trace], model: str | None, machine: str | None, effects: str | None
) -> Model:
    """Returns the model from which the fit starts."""
    from model.machine_model.model import base_model

    if model is not None and machine is not None:
        raise SpecError("--model and --machine: name one of them; a model has its machine")
    if model is not None:
        begin = read_model(model)
        return begin if effects is None else with_effects(begin, effects)
    chosen = machine_of(traces, robot) if machine is None else load_machine(machine)
    if effects is None:
        return base_model(chosen)
    return with_effects(base_model(chosen, friction=False), effects)


def _print_result(
    found: FitResult,
    agreement: Sequence[ModelAgreement],
    out: Path,
    base: BaseParameters | None = None,
    *,
    as_json: bool,
) -> None:
    if as_json:
        _print_json(found, agreement, out, base)
    else:
        _print(found, agreement, base)


def _print_json(found: FitResult, agreement: Sequence[ModelAgreement], out: Path, base: BaseParameters | None) -> None:

    print_json(
        {
            "model": found.model.identity,
            "file": out,
            "parameters": [p.model_dump(mode="json") for p in found.parameters],
            "undetermined": [c.model_dump(mode="json") for c in found.identifiability.undetermined],
            "verdict": None if found.verdict is None else found.verdict.model_dump(mode="json"),
            "base_parameters": None if base is None else base.model_dump(mode="json"),
            "agreement": [one.model_dump(mode="json") for one in agreement],
            "whitened_mean_square": found.whitened_mean_square,
            "converged": found.converged,
            "on_the_edge": list(found.on_the_edge),
            "record": [finding.model_dump(mode="json") for finding in found.record],
            "evaluations": found.evaluations,
            "seconds": found.seconds,
        }
    )


def _print(found: FitResult, agreement: Sequence[ModelAgreement], base: BaseParameters | None) -> None:
    from model.comparison.agreement import ALONE
    from model.reports.motion import AGREEMENT, agreement_table

    print_record(found.record)
    print_parameters(found.parameters)
    known = sum(p.verdict == "known" for p in found.parameters)
    print(f"\nknown: {known} of {len(found.parameters)}", end="")
    print("; of the others, in brackets, the model has one value of many" if known < len(found.parameters) else "")
    print_undetermined(found.identifiability)
    if base is not None:
        from model.base_parameters.result import headline

        print_prose(headline(base))
    print()
    print_rows(agreement_table(agreement).only(*AGREEMENT))
    print_prose(ALONE)
    if not found.converged:
        print(f"the search did not converge: {found.message}")
    print_on_the_edge(found.on_the_edge)
    print()
    for line in found.said:
        print_prose(line)
    if found.verdict is not None and found.verdict.asks_for_diagnosis:
        print("next: daq diagnose, with the same traces and the model before the fit")
