"""`daq backup`: writes all data of a service into one file."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from daq_cli.app.context import JsonOption, console, invocation, print_json

app = typer.Typer(add_completion=False)


@app.command()
def backup(
    context: typer.Context,
    file: Annotated[Path, typer.Argument(help="The .zip file to write; it must not exist yet.")],
    json: JsonOption = False,
) -> None:
    """Copy the service's database, traces, models and results into one file, also while the service runs."""
    from daq_cli.app.progress import shown_progress
    from extras.lab.backup.places import places_of
    from extras.lab.backup.write import back_up
    from server.clock import SystemClock

    places = places_of(invocation(context).configuration)
    with shown_progress("backup") as progress:
        made = back_up(places, file, SystemClock().utc(), progress)
    if json:
        counted = {"bytes": made.size, "traces": made.count("traces"), "models": made.count("models")}
        print_json({"file": file, **made.model_dump(mode="json", exclude={"files"}), **counted})
        return
    for name in made.left_out:
        console().print(f"left out, deleted meanwhile: {name}", markup=False)
    print(f"{file}: {made.count('traces')} traces, {made.count('models')} models, {made.size / 1e6:.1f} MB")
