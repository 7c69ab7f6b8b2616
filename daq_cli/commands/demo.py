"""`daq demo`: the ramp step of the 1991 experiment on the mock, from command to plot."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from daq_cli.app.consent import ConsentPrompt
from daq_cli.app.context import Invocation, console

app = typer.Typer(add_completion=False)


@app.command()
def demo(
    folder: Annotated[Path, typer.Option(help="Folder for the trace and the plots.")] = Path("demo"),
    seed: Annotated[int, typer.Option(help="Seed of the mock's noise.")] = 1991,
    real_time: Annotated[bool, typer.Option("--real-time", help="Run in real time instead of lock-step.")] = False,
) -> None:
    """Start the mock controller, run the ramp step on joints 1-3, record the trace, and show the results."""
    from daq.contracts.experiment import ExperimentSpec
    from daq.contracts.machine import load_machine
    from daq.traces.plot import plot_trace
    from daq.traces.reader import read_trace
    from daq_cli.robot.access import robot_access
    from daq_cli.robot.experiment import acquire_complete, print_result

    url = f"mock://?seed={seed}" + ("" if real_time else "&lock_step=1")
    console().print(
        "The mock controller stands in for the arm: 21.6° in 0.65 s on joints 1-3 (section 6.5 of the thesis)"
    )
    spec = ExperimentSpec(name="demo-ramp", notes="made by `daq demo`")
    robot = robot_access(Invocation(port_option=url))
    finished = acquire_complete(robot, spec, load_machine("ma2000"), folder, ConsentPrompt(False))
    pictures = [plot_trace(read_trace(finished.trace), finished.trace.with_suffix(end)) for end in (".png", ".html")]
    print_result(finished, pictures)
