"""`daq design`: proposes experiments that determine a model's parameters best, or evaluates given ones."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from daq.contracts.errors import SpecError
from daq_cli.app.context import JsonOption, console, print_json
from daq_cli.models.effect_choice import patterns
from daq_cli.models.model_input import MODEL_HELP, EffectFileOption, ReportOption, load_effects, read_model

if TYPE_CHECKING:
    from collections.abc import Sequence

    import numpy as np
    from numpy.typing import NDArray

    from daq.contracts.experiment import ExperimentSpec
    from model.design.information import InformationGain
    from model.design.search import DesignedExperiments
    from model.fitting.result import FitResult
    from model.machine_model.model import Model

app = typer.Typer(add_completion=False)


@app.command()
def design(
    model: Annotated[str, typer.Argument(help=MODEL_HELP)],
    out: Annotated[
        Path | None, typer.Option("--out", "-o", help="Folder to write the experiments to, one .json file each.")
    ] = None,
    judge: Annotated[
        list[Path] | None,
        typer.Option(help="Judge this experiment (.json) instead of proposing some. May be repeated."),
    ] = None,
    parameters: Annotated[
        str | None, typer.Option(help="Parameters to be determined: names or patterns (default: all uncertain ones).")
    ] = None,
    experiments: Annotated[int, typer.Option(min=1, max=50, help="Number of experiments to propose.")] = 4,
    duration: Annotated[float, typer.Option(min=1.0, max=600.0, help="Length of each experiment in s.")] = 12.0,
    candidates: Annotated[
        int, typer.Option(min=1, max=10_000, help="Number of random experiments to choose from.")
    ] = 60,
    seed: Annotated[int, typer.Option(min=0, help="Seed of the random experiments.")] = 0,
    report: ReportOption = None,
    effect_file: EffectFileOption = None,
    json: JsonOption = False,
) -> None:
    """Propose experiments within the machine's limits that determine chosen parameters best (D-optimal).

    Nothing is run: `daq run spec FILE` runs a proposed experiment.
    """
    from daq.safety.planned import planned
    from daq_cli.app.progress import shown_progress
    from model.design.information import information_gain
    from model.design.search import DesignOptions
    from model.design.search import design as search
    from model.fitting.options import FitOptions

    load_effects(effect_file)
    chosen = read_model(model)
    options = FitOptions(parameters=patterns(parameters))

    def plan(spec: ExperimentSpec) -> NDArray[np.float64]:
        return planned(spec, chosen.machine)

    if judge:
        from daq_cli.robot.experiment import read_spec

        specs = [read_spec(p) for p in judge]
        gain = information_gain(chosen, specs, plan, options=options, fitted=_fitted(model, parameters))
        if json:
            print_json(gain.model_dump(mode="json"))
        else:
            _print_gain(gain)
        _report(report, chosen, specs, gain, "The experiments were given, and judged by this model.")
        return
    with shown_progress("designing") as progress:
        search_options = DesignOptions(experiments=experiments, duration=duration, candidates=candidates, seed=seed)
        found = search(chosen, plan, search_options, options, progress)
    files = [] if out is None else _written(found.specs, out)
    if json:
        print_json(found.model_dump(mode="json") | {"files": files})
    else:
        _print_design(found, files)
    how = (
        f"{found.considered} candidates were drawn with seed {seed}, {found.refused} of them outside the limits; from "
        "the others those were taken that make the ellipsoid of uncertainty smallest (D-optimal), then exchanged."
    )
    _report(report, chosen, found.specs, found.gain, how, found.nats)


def _print_design(found: DesignedExperiments, files: Sequence[Path]) -> None:
    print(f"{len(found.specs)} of {found.considered} candidates, {found.refused} outside the limits")
    for spec, nats in zip(found.specs, found.nats, strict=True):
        print(f"  {spec.name}: {spec.trajectory.kind}; with those before it {nats:.1f} nats")
    _print_gain(found.gain)
    for file in files:
        console().print(f"daq run spec {file}")


def _report(
    path: Path | None,
    model: Model,
    specs: Sequence[ExperimentSpec],
    gain: InformationGain,
    how: str,
    nats: Sequence[float] | None = None,
) -> None:
    """Writes the report on these experiments, if one was requested."""
    if path is None:
        return
    from daq.safety.planned import planned
    from model.reports.design_report import PlannedExperiment, design_report
    from model.reports.page import write_report

    plans = [
        PlannedExperiment(spec, planned(spec, model.machine), None if nats is None else nats[number])
        for number, spec in enumerate(specs)
    ]
    console().print(f"report: {write_report(design_report(model, plans, gain, how), path)}")


def _fitted(model: str, parameters: str | None) -> FitResult | None:
    """Returns the result of the fit that made the model, if it has the requested parameters."""
    from model.fitting.result import is_result, load_result

    if not model.endswith(".json") or parameters is not None or not is_result(Path(model)):
        return None
    return load_result(Path(model))


def _written(specs: tuple[ExperimentSpec, ...], folder: Path) -> list[Path]:
    try:
        folder.mkdir(parents=True, exist_ok=True)
        files = []
        for number, spec in enumerate(specs, start=1):
            files.append(folder / f"experiment-{number}.json")
            files[-1].write_text(spec.model_dump_json(indent=1) + "\n", "utf-8")
    except OSError as error:
        raise SpecError(f"{folder}: cannot be written: {error.strerror}") from error
    return files


def _print_gain(gain: InformationGain) -> None:
    from daq_cli.models.parameter_table import print_rows
    from model.reports.design_report import gain_table

    print_rows(gain_table(gain))
    print(f"together: {gain.nats:.1f} more nats of information")
