"""`daq sensitivity`: shows which parameter changes which joint's response, how much, and when."""

from __future__ import annotations

import csv
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from daq_cli.app.context import JsonOption, console, print_json
from daq_cli.app.output_file import PICTURES, replacing, table_or_picture
from daq_cli.models.effect_choice import patterns
from daq_cli.models.model_input import (
    MODEL_HELP,
    EffectFileOption,
    ReportOption,
    TraceFolderOption,
    load_effects,
    model_label,
    read_model,
    read_traces,
)
from daq_cli.robot.access import robot_of

if TYPE_CHECKING:
    from daq.contracts.machine import Machine
    from model.analysis.sensitivity import SensitivityCurves

app = typer.Typer(add_completion=False)


@app.command()
def sensitivity(
    context: typer.Context,
    model: Annotated[str, typer.Argument(help=MODEL_HELP)],
    trace: Annotated[
        str, typer.Argument(help="A file (.mcap, .csv), the beginning of a trace's number or name, `last`.")
    ],
    parameters: Annotated[
        str | None, typer.Option(help="Names or patterns (default: those that were fitted, else all uncertain).")
    ] = None,
    output: Annotated[
        Path | None,
        typer.Option("--output", "-o", callback=table_or_picture, help="The curves: .csv, or .png, .svg, .pdf."),
    ] = None,
    open_loop: Annotated[
        bool,
        typer.Option("--open-loop", help="Apply the recorded drive, so that no controller compensates changes."),
    ] = False,
    report: ReportOption = None,
    folder: TraceFolderOption = None,
    effect_file: EffectFileOption = None,
    json: JsonOption = False,
) -> None:
    """Show how each joint's reading changes along a trace when a parameter is off by its expected deviation.

    The change is exact to first order, and each parameter changes alone. A parameter whose curve stays within the noise
    of a reading cannot be determined from this trace. Two parameters with curves of the same shape cannot be
    distinguished.
    """
    from daq_cli.app.progress import shown_progress
    from daq_cli.models.parameter_table import print_rows
    from model.analysis.sensitivity import sensitivity_curves
    from model.reports.sensitivity_report import changes_table
    from model.simulation.prepared import Options
    from model.validation.names import names_to_validate

    load_effects(effect_file)
    (read,) = read_traces(robot_of(context), folder, [trace])
    chosen = read_model(model)
    names = names_to_validate(chosen, patterns(parameters))
    with shown_progress("sensitivities") as progress:
        progress(0.0, f"{len(names)} parameters")
        found = sensitivity_curves(chosen, read, names, options=Options(loop="open" if open_loop else "closed"))
    if json:
        print_json(found.model_dump(mode="json"))
    else:
        print(f"{model_label(model)} ({found.model}), {found.trace}: largest change of each joint's reading, and when")
        print_rows(changes_table(found, chosen.machine))
    if output is not None:
        _write(found, chosen.machine, output)
        console().print(f"curves: {output}")
    if report is not None:
        from model.reports.page import write_report
        from model.reports.sensitivity_report import sensitivity_report

        page = sensitivity_report(model_label(model), found, chosen.machine)
        console().print(f"report: {write_report(page, report)}")


def _write(found: SensitivityCurves, machine: Machine, path: Path) -> None:
    """Raises SpecError if the file cannot be written."""
    if path.suffix in PICTURES:
        from model.reports.sensitivity_report import save_curves

        with replacing(path) as part:
            save_curves(found, machine, part, path.suffix.removeprefix("."))
        return
    with replacing(path) as part, part.open("w", newline="", encoding="utf-8") as stream:
        rows = csv.writer(stream, lineterminator="\n")
        rows.writerow(["time", *(f"{c.name}@joint{joint}" for c in found.curves for joint in found.joints)])
        series = [values for c in found.curves for values in c.by_joint]
        rows.writerows([f"{t:.6f}", *(f"{v[k]:.9g}" for v in series)] for k, t in enumerate(found.time))
