"""`daq thesis`: the 1991 source reproduced, with our numbers beside the published ones.

The reproduction as plain text, ours beside the published.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Annotated

import typer

from daq_cli.app import completion
from daq_cli.app.context import Invocation, JsonOption, console, print_json
from daq_cli.models.model_input import ReportOption, read_traces
from daq_cli.robot.access import robot_access, robot_of
from extras.thesis.ladder import Ladder
from extras.thesis.reproduction import Reproduction
from extras.thesis.tables import SYMBOLS

if TYPE_CHECKING:
    from daq.contracts.trace import Trace


def as_text(result: Reproduction) -> str:
    """Lines for a terminal or a file, without colour."""
    ladders = [line for ladder in result.ladders for line in _ladder(ladder)]
    return "\n".join([*_fidelity(result), *ladders, *_checks(result), *_choices(result), *_findings(result)])


def _fidelity(result: Reproduction) -> Iterator[str]:
    yield "Σλ² recomputed from the published tables"
    yield f"  {'model':20}{'published':>11}{'τ′ = â/(3√2)':>15}{'τ′ = â/3':>12}"
    both = [[f for f in result.fidelity if f.convention == c] for c in ("source", "three_sigma")]
    for source, three in zip(*both, strict=True):
        yield f"  {source.name:20}{source.published:11.4f}{source.ours:15.4f}{three.ours:12.4f}"
    yield ""


def _ladder(ladder: Ladder) -> Iterator[str]:
    yield f"The four models fitted by {ladder.method} to {', '.join(ladder.traces)} (ours | published)"
    yield f"  unoptimised (table 7.2): {ladder.unoptimised_error:.4g} | 2.1428e-3 rad²"
    yield "  " + " " * 18 + "".join(f"{s.name:^26}" for s in ladder.steps)
    yield _row("MSQE rad²", [(s.error, s.published_error) for s in ladder.steps])
    yield _row("Σλ²", [(s.fidelity.sum_of_contributions, s.published_sum) for s in ladder.steps])
    for symbol in SYMBOLS:
        pairs = [
            (s.values[symbol.name], s.published_values[symbol.name]) if symbol.name in s.values else None
            for s in ladder.steps
        ]
        yield _row(f"{symbol.name} {symbol.unit}", pairs)
    yield ""


def _row(name: str, pairs: list[tuple[float, float] | None]) -> str:
    cells = ["" if pair is None else f"{pair[0]:10.4g} | {pair[1]:<10.4g}" for pair in pairs]
    return f"  {name:18}" + "".join(f"{cell:^26}" for cell in cells)


def _checks(result: Reproduction) -> Iterator[str]:
    yield f"What the source says: {len(result.checks) - len(result.failed)} of {len(result.checks)} borne out"
    for check in result.checks:
        yield f"  {'yes' if check.holds else 'NO ':3} {check.name}"
        yield f"        ours: {check.ours}"
        yield f"        published: {check.published}"
    yield ""


def _choices(result: Reproduction) -> Iterator[str]:
    yield "Not given by the source, and chosen"
    for choice in result.choices:
        yield f"  {choice.what}: {choice.value} ({choice.why})"
    yield ""


def _findings(result: Reproduction) -> Iterator[str]:
    yield "Found on the way"
    for finding in result.findings:
        yield f"  - {finding}"


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
    """The ramp of section 6.5 on a mock of its own, in lock-step: the same seed gives the same record."""
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
