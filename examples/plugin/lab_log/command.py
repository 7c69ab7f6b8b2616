"""`daq lab-log`: a Typer named `app`, as every command has."""

from pathlib import Path

import typer

from daq.contracts.import_choice import Choice
from daq.contracts.trace_limits import DEFAULT_TRACE_LIMITS
from lab_log.log import read

app = typer.Typer(add_completion=False)


@app.command()
def lab_log(file: Path) -> None:
    """Show how many rows a log has."""
    trace = read(file, DEFAULT_TRACE_LIMITS, Choice())
    print(f"{file}: {len(trace)} rows in {trace.time[-1] - trace.time[0]:g} s")
