"""`daq residual`: does the machine file describe what was measured?"""

from __future__ import annotations

import math
from pathlib import Path
from typing import Annotated

import typer

from daq.cli.context import JsonOption, console, invocation, print_json

app = typer.Typer(add_completion=False)


@app.command()
def residual(
    context: typer.Context,
    trace: Annotated[
        str, typer.Argument(help="A file, the beginning of a trace's number or name, or `last`.")
    ] = "last",
    folder: Annotated[Path | None, typer.Option(help="Folder of traces (default: the configured one).")] = None,
    json: JsonOption = False,
) -> None:
    """Simulate a trace from its recorded set points with the machine file's numbers, and show what is left.

    Nothing is fitted: this is the model as the machine file has it, viscous and Coulomb friction included.
    """
    import numpy as np

    from daq.traces.catalogue import find_trace
    from daq.traces.reader import read_trace
    from model.machine_model.model import base_model
    from model.simulation.simulate import simulate

    call = invocation(context)
    path = find_trace(folder or call.trace_folder, trace)
    found = read_trace(path)
    machine = found.record.machine or call.settings.machine()
    console().print("simulating (the first time in a new installation compiles for some seconds) …")
    simulation = simulate(base_model(machine), found)
    rows = []
    for index, joint in enumerate(simulation.joints):
        measured = found.position[:, found.column(joint)]
        left = measured - simulation.at_samples(simulation.reading)[:, index]
        count = abs(machine.calibration(joint).rad_per_count)
        rms, largest = float(np.sqrt(np.mean(left**2))), float(np.abs(left).max())
        rows.append({"joint": joint, "rms": rms, "largest": largest, "rms_counts": rms / count})
    if json:
        print_json({"path": path, "model": f"{machine.name}, as in its machine file", "residuals": rows})
        return
    print(f"measured − simulated, {machine.name} as in its machine file, nothing fitted:")
    for row in rows:
        print(
            f"  joint {row['joint']}: rms {math.degrees(row['rms']):.3f}° ({row['rms_counts']:.1f} ADC counts), "
            f"largest {math.degrees(row['largest']):.3f}°"
        )
