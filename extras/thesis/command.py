"""`daq thesis`: reproduces the 1991 source, with our values beside the published ones."""

from __future__ import annotations

from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Annotated

import typer

from daq_cli.app import completion
from daq_cli.app.context import Invocation, JsonOption, console, print_json
from daq_cli.models.model_input import ReportOption, read_traces
from daq_cli.robot.access import robot_access, robot_of

if TYPE_CHECKING:
    from daq.contracts.trace import Trace

app = typer.Typer(add_completion=False)


@app.command()
def thesis(
    context: typer.Context,
    trace: Annotated[
        list[str] | None,
        typer.Option(
            help="Use this trace of the ramp instead of a new one. May be repeated.", autocompletion=completion.traces
        ),
    ] = None,
    seed: Annotated[int, typer.Option(min=0, help="Seed of the mock's noise.")] = 1991,
    nelder_mead: Annotated[
        bool,
        typer.Option(
            "--nelder-mead/--no-nelder-mead", help="Fit by Nelder-Mead too, as the source did; this takes minutes."
        ),
    ] = True,
    folder: Annotated[
        Path | None, typer.Option(help="Folder that keeps the new trace (default: it is not kept).")
    ] = None,
    report: ReportOption = None,
    json: JsonOption = False,
) -> None:
    """Reproduce the 1991 source: recompute its sums, fit its four models, and repeat its figures and control runs.

    The trace comes from the mock, whose arm has the complete friction of table 7.9, recorded in lock-step; the traces
    measured in 1991 are lost.
    """
    from daq_cli.app.progress import shown_progress
    from extras.thesis.reproduction import reproduce_thesis
    from extras.thesis.text import as_text

    traces = read_traces(robot_of(context), folder, trace) if trace else [recorded_ramp(seed, folder)]
    with shown_progress("reproducing") as progress:
        found = reproduce_thesis(
            traces, ("nelder_mead", "least_squares") if nelder_mead else ("least_squares",), progress=progress
        )
    if json:
        print_json(found.model_dump(mode="json"))
    else:
        print(as_text(found))
    if report is not None:
        from extras.thesis.report import thesis_report
        from model.reports.page import write_report

        console().print(f"report: {write_report(thesis_report(found), report)}")


def recorded_ramp(seed: int, folder: Path | None = None) -> Trace:
    """Records the ramp of section 6.5 on a mock of its own, in lock-step: the same seed gives the same record."""
    from daq.contracts.experiment import ExperimentSpec
    from daq.contracts.machine import load_machine
    from daq.traces.reader import read_trace
    from daq_cli.app.consent import ConsentPrompt
    from daq_cli.robot.experiment import acquire_complete

    spec = ExperimentSpec(name="thesis-ramp", notes="made by `daq thesis`")
    robot = robot_access(Invocation(port_option=f"mock://?seed={seed}&lock_step=1"))
    with TemporaryDirectory() as temporary:
        place = folder or Path(temporary)
        finished = acquire_complete(robot, spec, load_machine("ma2000"), place, ConsentPrompt(False))
        return read_trace(finished.trace)
