"""`daq simulate`: simulates recorded traces with a model, from their set points or their drive."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from daq.contracts.errors import SpecError
from daq_cli.app.context import JsonOption, console, print_json
from daq_cli.app.csv_output import check_csv, write_csv
from daq_cli.app.output_file import check_folder
from daq_cli.commands.fit import OpenLoopOption
from daq_cli.models.model_input import (
    MODEL_HELP,
    EffectFileOption,
    ReportOption,
    TraceFolderOption,
    TracesArgument,
    load_effects,
    model_label,
    read_model,
    read_traces,
)
from daq_cli.models.record_doubts import DespiteDoubtsOption, stop_if_doubted
from daq_cli.robot.access import robot_of

if TYPE_CHECKING:
    from daq.contracts.trace import Trace
    from model.machine_model.model import Model
    from model.simulation.prepared import Options

app = typer.Typer(add_completion=False)

OutputOption = Annotated[
    Path | None,
    typer.Option("--output", "-o", help="The simulated trace: .csv, .mcap, or a picture (.png, .svg, .pdf)."),
]

NoRoundingOption = Annotated[
    bool, typer.Option("--no-rounding", help="Leave readings and drive unrounded, unlike a real board.")
]


@app.command()
def simulate(
    context: typer.Context,
    model: Annotated[str, typer.Argument(help=MODEL_HELP)],
    traces: TracesArgument,
    output: OutputOption = None,
    open_loop: OpenLoopOption = False,
    no_rounding: NoRoundingOption = False,
    report: ReportOption = None,
    folder: TraceFolderOption = None,
    effect_file: EffectFileOption = None,
    despite_doubts: DespiteDoubtsOption = False,
    json: JsonOption = False,
) -> None:
    """Simulate traces from their recorded set points, and show the difference between measured and simulated.

    Nothing is fitted. A machine is used as its file describes it, including the friction stated there.
    """
    from daq_cli.app.progress import shown_progress
    from daq_cli.models.parameter_table import print_rows
    from model.comparison.compare import compare
    from model.reports.motion import AGREEMENT, agreement_table
    from model.simulation.prepared import Options

    load_effects(effect_file)
    found = read_traces(robot_of(context), folder, traces)
    if output is not None and len(found) != 1:
        raise SpecError(f"--output {output}: is for one trace, {len(found)} are named")
    if output is not None:
        check_folder(output, "--output")
        if output.suffix == ".csv":
            check_csv(output)
    chosen = read_model(model)
    stop_if_doubted(chosen, found, despite_doubts=despite_doubts, as_json=json)
    options = Options(loop="open" if open_loop else "closed", quantise=not no_rounding)
    with shown_progress("simulating") as progress:
        comparison = compare([(model_label(model), chosen)], found, options=options, progress=progress)
    if json:
        print_json({"model": chosen.identity, "agreement": comparison.models[0].model_dump(mode="json")})
    else:
        print(f"measured − simulated, {model_label(model)} ({chosen.identity}), nothing fitted:")
        print_rows(agreement_table(comparison.models).only(*AGREEMENT))
    if output is not None:
        console().print(f"simulated trace: {_written(_simulated(chosen, found[0], options), output)}")
    if report is not None:
        from model.reports.comparison_report import comparison_report
        from model.reports.page import write_report

        console().print(f"report: {write_report(comparison_report(comparison), report)}")


def _simulated(model: Model, trace: Trace, options: Options) -> Trace:
    """Returns the trace that the model would have recorded."""
    from daq.contracts.trace import Trace
    from model.simulation.simulate import simulate

    run = simulate(model, trace, options)
    columns = [trace.column(j) for j in run.joints]
    record = trace.record.model_copy(
        update={
            "trace_id": f"{trace.record.trace_id}-simulated",
            "source": "imported",
            "software": f"{trace.record.software}; simulated with model {model.identity}",
            "notes": f"simulated with model {model.identity} from trace {trace.record.trace_id}",
            "counters": {},
        }
    )
    made = Trace(
        record,
        run.joints,
        trace.time,
        run.at_samples(run.reading),
        error=run.at_samples(run.error),
        drive=run.at_samples(run.drive),
        velocity=run.at_samples(run.velocity),
        tick=trace.tick,
    )
    if trace.set_point is None:
        return replace(made, error=None)
    return replace(made, set_point=trace.set_point[:, columns])


def _written(trace: Trace, path: Path) -> Path:
    if path.suffix == ".csv":
        return write_csv(trace, path)
    if path.suffix == ".mcap":
        from daq.traces.store import write_trace

        return write_trace(trace, path)
    from daq.traces.plot import plot_trace

    return plot_trace(trace, path)
