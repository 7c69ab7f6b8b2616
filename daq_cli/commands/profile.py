"""`daq profile`: profile likelihoods, which show whether traces bound a parameter on both sides, one side, or none."""

from __future__ import annotations

import csv
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from daq.contracts.errors import SpecError
from daq_cli.app.context import JsonOption, console, print_json
from daq_cli.app.output_file import PICTURES, replacing, table_or_picture
from daq_cli.models.effect_choice import bounds, patterns, with_effects
from daq_cli.models.model_input import (
    MODEL_HELP,
    EffectFileOption,
    ReportOption,
    TraceFolderOption,
    TracesArgument,
    load_effects,
    read_model,
    read_traces,
)
from daq_cli.models.record_doubts import DespiteDoubtsOption, stop_if_doubted
from daq_cli.robot.access import robot_of

if TYPE_CHECKING:
    from collections.abc import Sequence

    from daq.contracts.trace import Trace
    from model.fitting.options import FitOptions
    from model.fitting.profile import Profile
    from model.fitting.result import FitResult

app = typer.Typer(add_completion=False)


@app.command()
def profile(
    context: typer.Context,
    model: Annotated[
        str, typer.Argument(help=f"The model to fit, or a fit of these traces, which is used as it is. {MODEL_HELP}")
    ],
    traces: TracesArgument,
    parameter: Annotated[
        list[str], typer.Option("--parameter", help="A parameter to profile, such as load.mass. May be repeated.")
    ],
    effects: Annotated[
        str | None, typer.Option(help="Effects besides rigid bodies and motors (default: the model's own).")
    ] = None,
    parameters: Annotated[
        str | None, typer.Option(help="Parameters to fit: names or patterns (default: all uncertain ones).")
    ] = None,
    hold: Annotated[str | None, typer.Option(help="Parameters to hold at their values: names or patterns.")] = None,
    bound: Annotated[
        list[str] | None, typer.Option(help="Bounds of a parameter, name=low:high. May be repeated.")
    ] = None,
    no_priors: Annotated[
        bool, typer.Option("--no-priors", help="Fit without the expected deviations of the parameters.")
    ] = False,
    starts: Annotated[
        int, typer.Option(min=1, max=100, help="Number of fits from different starting values; the best is profiled.")
    ] = 1,
    seed: Annotated[int, typer.Option(min=0, help="Seed of the starting values.")] = 0,
    output: Annotated[
        Path | None,
        typer.Option("--output", "-o", callback=table_or_picture, help="The profiles: .csv, or .png, .svg, .pdf."),
    ] = None,
    report: ReportOption = None,
    folder: TraceFolderOption = None,
    effect_file: EffectFileOption = None,
    despite_doubts: DespiteDoubtsOption = False,
    json: JsonOption = False,
) -> None:
    """Show how much worse the best fit becomes when a parameter is moved and all others are fitted again.

    Unlike an interval from a covariance, a profile shows if the traces bound a parameter on one side only, or not at
    all. If a model or a machine is given, it is fitted first.
    """
    from daq_cli.app.progress import shown_progress
    from model.fitting.options import FitOptions
    from model.fitting.profile import profile as profile_of

    load_effects(effect_file)
    read = read_traces(robot_of(context), folder, traces)
    options = FitOptions(
        parameters=patterns(parameters),
        held=patterns(hold) or (),
        bounds=bounds(bound or []),
        use_priors=not no_priors,
        starts=starts,
        seed=seed,
    )
    stop_if_doubted(read_model(model), read, despite_doubts=despite_doubts, as_json=json)
    fitted = _fitted(model, effects, read, options, parameter)
    found = []
    for name in parameter:
        with shown_progress(name) as progress:
            found.append(profile_of(fitted, read, name, progress))
    if json:
        print_json({"model": fitted.model.identity, "profiles": [one.model_dump(mode="json") for one in found]})
    else:
        _print(found)
    if output is not None:
        _write(fitted, found, output)
        console().print(f"profiles: {output}")
    if report is not None:
        from model.reports.page import write_report
        from model.reports.profile_report import profile_report

        console().print(f"report: {write_report(profile_report(fitted, found), report)}")


def _fitted(
    name: str, effects: str | None, traces: Sequence[Trace], options: FitOptions, profiled: Sequence[str]
) -> FitResult:
    """Returns the fit to profile: a saved one unchanged, unless fit options are given; otherwise a new one."""
    from daq_cli.app.progress import shown_progress
    from model.fitting.choice import chosen_unknowns
    from model.fitting.fit import fit
    from model.fitting.options import FitOptions
    from model.fitting.result import is_result, load_result

    path = Path(name)
    saved = load_result(path) if path.suffix == ".json" and path.is_file() and is_result(path) else None
    if saved is not None and effects is None and options == FitOptions():
        for one in profiled:
            saved.parameter(one)
        return saved
    if saved is not None:  # options that are not given are those of the saved fit
        given = options.model_dump(exclude_defaults=True)
        options = saved.options.model_copy(update={key: getattr(options, key) for key in given})
    begin = read_model(name) if saved is None else saved.model
    begin = begin if effects is None else with_effects(begin, effects)
    free = [unknown.name for unknown in chosen_unknowns(begin, options)]
    if missing := [one for one in profiled if one not in free]:
        raise SpecError(f"--parameter {missing[0]}: is not fitted; fitted are {', '.join(free)}")
    with shown_progress("fitting") as progress:
        return fit(begin, traces, options, progress)


def _print(found: Sequence[Profile]) -> None:
    from daq_cli.models.parameter_table import print_rows
    from model.reports.profile_report import better_fit, bounds_table

    print_rows(bounds_table(found))
    if any(None in (one.low, one.high) for one in found):
        print("– these traces do not bound it on this side, as far as the profile reaches")
    if better := [one.name for one in found if one.better]:
        print(better_fit(better))


def _write(fitted: FitResult, found: Sequence[Profile], path: Path) -> None:
    """Raises SpecError if the file cannot be written."""
    if path.suffix in PICTURES:
        from model.reports.profile_report import save_profiles

        with replacing(path) as part:
            save_profiles(fitted, found, part, path.suffix.removeprefix("."))
        return
    with replacing(path) as part, part.open("w", newline="", encoding="utf-8") as stream:
        rows = csv.writer(stream, lineterminator="\n")
        rows.writerow(["parameter", "unit", "value", "rise"])
        for one in found:
            points = zip(one.values, one.rises, strict=True)
            rows.writerows([one.name, one.unit, f"{value:.9g}", f"{rise:.6g}"] for value, rise in points)
