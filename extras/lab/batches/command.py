"""`daq batch`: the same fit, validation, simulation or diagnosis of many traces, with a table as result."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from daq.contracts import exit_codes
from daq_cli.app import completion
from daq_cli.app.context import JsonOption
from daq_cli.commands.fit import (
    BoundOption,
    ConsistentOption,
    HoldOption,
    MethodOption,
    NoPriorsOption,
    OpenLoopOption,
    ParametersOption,
    SeedOption,
)
from daq_cli.commands.simulate import NoRoundingOption
from daq_cli.models.model_input import (
    MODEL_HELP,
    CandidatesOption,
    ComparisonOption,
    EffectFileOption,
    ExaminedOption,
    MostOption,
)
from daq_cli.models.record_doubts import DespiteDoubtsOption
from daq_cli.robot.access import robot_of
from extras.lab.batches.executors import LOCAL
from extras.lab.batches.shown import Asked, run

if TYPE_CHECKING:
    from extras.lab.batches.study import Study

app = typer.Typer(
    add_completion=False,
    help="Study many traces, each by itself: a table is the result. The same command goes on after an interruption.",
    no_args_is_help=True,
)

TracesOf = Annotated[
    str,
    typer.Argument(
        metavar="FOLDER|QUERY",
        help="A folder of traces; or which of the configured folder: words, and kind:, source:, outcome:, robot:, "
        "since:, until:.",
    ),
]
ExecutorOption = Annotated[
    str,
    typer.Option("--executor", help="Who computes: local://4 (processes), or dask://host:8786."),
]
OutOption = Annotated[Path, typer.Option("--out", "-o", help="Folder of the result; a batch in it goes on.")]
ModelOption = Annotated[
    str | None, typer.Option(help=f"The model of all traces (default: the machine of each). {MODEL_HELP}")
]


@app.command()
def fit(
    context: typer.Context,
    traces: TracesOf,
    out: OutOption,
    executor: ExecutorOption = LOCAL,
    model: ModelOption = None,
    effects: Annotated[
        str | None,
        typer.Option(
            help="Effects to add to the model before it is fitted, such as backlash:2-3.",
            autocompletion=completion.effects,
        ),
    ] = None,
    effect_file: EffectFileOption = None,
    parameters: ParametersOption = None,
    hold: HoldOption = None,
    bound: BoundOption = None,
    no_priors: NoPriorsOption = False,
    method: MethodOption = "least_squares",
    starts: Annotated[int, typer.Option(min=1, max=20, help="Number of fits from different starting values.")] = 1,
    seed: SeedOption = 0,
    open_loop: OpenLoopOption = False,
    consistent_inertias: ConsistentOption = False,
    json: JsonOption = False,
) -> None:
    """Fit a model to every trace by itself: a row of parameters and errors for each."""
    from daq.contracts.service.jobs import FitStudy
    from daq_cli.models.effect_choice import bounds, effect_choices, patterns

    study = FitStudy(
        effects=effect_choices(effects, effect_file),
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
    _run(context, Asked(traces, out, executor, model, effect_file or (), json), study)


@app.command()
def validate(
    context: typer.Context,
    traces: TracesOf,
    out: OutOption,
    executor: ExecutorOption = LOCAL,
    model: ModelOption = None,
    effect_file: EffectFileOption = None,
    parameters: Annotated[
        str | None, typer.Option(help="Names or patterns (default: those that were fitted, else all uncertain).")
    ] = None,
    output: Annotated[
        list[int] | None, typer.Option("--joint", min=1, help="Joints whose errors count (default: all).")
    ] = None,
    damping_ratio: Annotated[
        float, typer.Option(min=0.001, max=10.0, help="ζ of the associate system (section 7.2.2).")
    ] = 0.5,
    json: JsonOption = False,
) -> None:
    """Validate a model against every trace by itself (Σλ²): a row for each."""
    from daq.contracts.service.jobs import ValidateStudy
    from daq_cli.models.effect_choice import patterns

    joints = None if output is None else tuple(output)
    study = ValidateStudy(parameters=patterns(parameters), joints=joints, damping_ratio=damping_ratio)
    _run(context, Asked(traces, out, executor, model, effect_file or (), json), study)


@app.command()
def simulate(
    context: typer.Context,
    traces: TracesOf,
    out: OutOption,
    executor: ExecutorOption = LOCAL,
    model: ModelOption = None,
    effect_file: EffectFileOption = None,
    open_loop: OpenLoopOption = False,
    no_rounding: NoRoundingOption = False,
    json: JsonOption = False,
) -> None:
    """Simulate every trace and compare it with the measurement: a row of errors for each."""
    from extras.lab.batches.study import SimulateStudy

    study = SimulateStudy(loop="open" if open_loop else "closed", quantise=not no_rounding)
    _run(context, Asked(traces, out, executor, model, effect_file or (), json), study)


@app.command()
def diagnose(
    context: typer.Context,
    traces: TracesOf,
    out: OutOption,
    executor: ExecutorOption = LOCAL,
    model: ModelOption = None,
    effect_file: EffectFileOption = None,
    effects: CandidatesOption = None,
    joints: ExaminedOption = None,
    most: MostOption = None,
    method: ComparisonOption = None,
    despite_doubts: DespiteDoubtsOption = False,
    json: JsonOption = False,
) -> None:
    """Diagnose every trace by itself: a row with verdict, effects and errors for each."""
    from daq.contracts.experiment import parse_joints
    from daq.contracts.service.jobs import DiagnoseStudy
    from daq_cli.models.effect_choice import candidate_effects

    names = candidate_effects(effects, effect_file)
    chosen = None if joints is None else tuple(parse_joints(joints))
    compared = None if method is None else method.value
    study = DiagnoseStudy(effects=names, joints=chosen, most_steps=most, method=compared, despite_doubts=despite_doubts)
    _run(context, Asked(traces, out, executor, model, effect_file or (), json), study)


def _run(context: typer.Context, asked: Asked, study: Study) -> None:
    if not run(robot_of(context), asked, study):
        raise typer.Exit(exit_codes.FAULT)
