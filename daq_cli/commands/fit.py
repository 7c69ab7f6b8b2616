"""`daq fit`: a model's parameters from traces, with what the traces cannot tell."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from daq.contracts.errors import SpecError
from daq.contracts.machine import load_machine
from daq_cli.app import completion
from daq_cli.app.context import Invocation, JsonOption, console, invocation, print_json
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
    load_effects,
    machine_of,
    read_model,
    read_traces,
)
from daq_cli.models.parameter_table import print_parameters
from daq_cli.robot.remote.jobs import numbers_of, require_no_programs

if TYPE_CHECKING:
    from collections.abc import Sequence

    from daq.contracts.trace import Trace
    from model.comparison.agreement import ModelAgreement
    from model.fitting.result import FitResult
    from model.machine_model.model import Model

app = typer.Typer(add_completion=False)

EffectsOption = Annotated[
    str | None,
    typer.Option(
        help="Effects beside rigid bodies and motors: viscous,coulomb:2-3 or none (default: the machine's).",
        autocompletion=completion.effects,
    ),
]
ParametersOption = Annotated[
    str | None, typer.Option(help="What to find: names or patterns such as *.mass,joint2.* (default: all uncertain).")
]


@app.command()
def fit(
    context: typer.Context,
    traces: TracesArgument,
    out: Annotated[Path, OutOption],
    model: Annotated[str | None, typer.Option(help=f"Begin from this one. {MODEL_HELP}")] = None,
    machine: Annotated[str | None, typer.Option(help="Machine file or name (default: the traces').")] = None,
    effects: EffectsOption = None,
    effect_file: EffectFileOption = None,
    parameters: ParametersOption = None,
    hold: Annotated[str | None, typer.Option(help="Names or patterns to leave as they are.")] = None,
    bound: Annotated[list[str] | None, typer.Option(help="name=low:high, instead of the model's own bounds.")] = None,
    holdout: HoldoutOption = None,
    no_priors: Annotated[bool, typer.Option("--no-priors", help="Leave expected deviations out.")] = False,
    method: Annotated[
        Literal["least_squares", "nelder_mead"], typer.Option(help="nelder_mead is the source's hill climbing.")
    ] = "least_squares",
    starts: Annotated[int, typer.Option(min=1, max=100, help="Searches, from different beginnings.")] = 1,
    seed: Annotated[int, typer.Option(min=0, help="Of the beginnings.")] = 0,
    open_loop: Annotated[bool, typer.Option("--open-loop", help="Apply the recorded drive.")] = False,
    torques: Annotated[
        bool, typer.Option("--torques", help="Compare torques instead of motion: no simulation, needs the drive.")
    ] = False,
    report: ReportOption = None,
    folder: TraceFolderOption = None,
    json: JsonOption = False,
) -> None:
    """Find the parameters with which a model best repeats traces, and name what the traces cannot tell."""
    from daq_cli.models.model_progress import shown_progress
    from model.comparison.compare import compare
    from model.fitting.fit import fit as run_fit
    from model.fitting.options import FitOptions
    from model.simulation.prepared import Options

    if torques and (method != "least_squares" or starts > 1 or seed or open_loop):
        raise SpecError("--torques: --method, --starts, --seed and --open-loop are of a fit of motion; leave them out")
    call = invocation(context)
    require_no_programs(effect_file, call)
    load_effects(effect_file)
    fitted_to = read_traces(call, folder, traces)
    held = read_traces(call, folder, holdout or []) if holdout else []
    begin = _beginning(call, fitted_to, model, machine, effects)
    loop: Literal["open", "closed"] | None = "open" if open_loop else None
    options = FitOptions(
        parameters=patterns(parameters), held=patterns(hold) or (), bounds=bounds(bound or []),
        use_priors=not no_priors, method=method, starts=starts, seed=seed, loop=loop,
    )  # fmt: skip
    if call.server is not None:
        from daq_cli.robot.remote.fit import fit_at_server

        if torques:
            raise SpecError("--torques: is computed here, not by a service; fetch the traces, then leave --server out")
        wanted = (numbers_of(call, traces, fitted_to), numbers_of(call, holdout or [], held))
        done = fit_at_server(call, begin, *wanted, options, out, report)
        _save(done, out, quiet=json)
        _tell(done, done.models, out, as_json=json)
        return
    if torques:
        from daq_cli.models.fit_torques import fit_recorded_torques

        fit_recorded_torques(begin, fitted_to, held, options, out, as_json=json, report=report)
        return
    with shown_progress("fitting") as tell:
        found = run_fit(begin, fitted_to, options, lambda f, text: tell(0.9 * f, text))
        _save(found, out, quiet=json)
        comparison = compare(
            [("before", begin), ("fitted", found.model)], [*fitted_to, *held], [t.record.trace_id for t in held],
            options=Options(loop=loop or "closed"), progress=lambda f, text: tell(0.9 + 0.1 * f, text),
        )  # fmt: skip
    _tell(found, comparison.models, out, as_json=json)
    if report is not None:
        from model.reports.fit_report import fit_report
        from model.reports.page import write_report

        console().print(f"report: {write_report(fit_report(found, comparison), report)}")


def _save(found: FitResult, out: Path, *, quiet: bool) -> None:
    """The model, and where it is; before anything else is made of it, which may fail."""
    with replacing(out) as part:
        found.save(part)
    if not quiet:
        console().print(f"model {found.model.identity}: {out}")


def _beginning(
    call: Invocation, traces: Sequence[Trace], model: str | None, machine: str | None, effects: str | None
) -> Model:
    """The model that the search begins from."""
    from model.machine_model.model import base_model

    if model is not None and machine is not None:
        raise SpecError("--model and --machine: name one of them; a model has its machine")
    if model is not None:
        begin = read_model(model)
        return begin if effects is None else with_effects(begin, effects)
    chosen = machine_of(traces, call) if machine is None else load_machine(machine)
    if effects is None:
        return base_model(chosen)
    return with_effects(base_model(chosen, friction=False), effects)


def _tell(found: FitResult, agreement: Sequence[ModelAgreement], out: Path, *, as_json: bool) -> None:
    if as_json:
        _print_json(found, agreement, out)
    else:
        _print(found, agreement)


def _print_json(found: FitResult, agreement: Sequence[ModelAgreement], out: Path) -> None:
    from daq_cli.models.agreement_table import agreement_data

    print_json({
        "model": found.model.identity,
        "file": out,
        "parameters": [p.model_dump(mode="json") for p in found.parameters],
        "undetermined": [c.model_dump(mode="json") for c in found.identifiability.undetermined],
        "agreement": agreement_data(agreement),
        "whitened_mean_square": found.whitened_mean_square,
        "converged": found.converged,
        "evaluations": found.evaluations,
        "seconds": found.seconds,
    })  # fmt: skip


def _print(found: FitResult, agreement: Sequence[ModelAgreement]) -> None:
    from daq_cli.models.agreement_table import print_agreement

    print_parameters(found.parameters)
    known = sum(p.verdict == "known" for p in found.parameters)
    print(f"\nknown: {known} of {len(found.parameters)}", end="")
    print("; no number is given for the others" if known < len(found.parameters) else "")
    for combination in found.identifiability.undetermined:
        print(f"  not determined: {combination.text}")
    print()
    print_agreement(agreement)
    if not found.converged:
        print(f"the search did not converge: {found.message}")
