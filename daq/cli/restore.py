"""`daq restore`: a backup, back to where the configuration has everything."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from daq.cli.context import console, invocation

app = typer.Typer(add_completion=False)


@app.command()
def restore(
    context: typer.Context,
    file: Annotated[Path, typer.Argument(help="A file that `daq backup` has made.")],
    check: Annotated[bool, typer.Option("--check", help="Read every byte of it, and change nothing.")] = False,
    overwrite: Annotated[
        bool, typer.Option("--overwrite", help="Put aside what is there: into folders before-restore-….")
    ] = False,
) -> None:
    """Bring back the database, traces, models and results of a backup. The service must not run."""
    from daq.cli.model_progress import shown_progress
    from server.backup.manifest import verify
    from server.backup.places import places_of
    from server.backup.restore import restore as bring_back
    from server.clock import SystemClock

    if check:
        with shown_progress("checking") as tell:
            found = verify(file, tell)
        what = "is as it was written"
    else:
        places = places_of(invocation(context).settings)
        with shown_progress("restore") as tell:
            done = bring_back(file, places, SystemClock().utc(), tell, overwrite=overwrite)
        for folder in done.put_aside:
            console().print(f"put aside what was there: {folder}", markup=False)
        found, what = done.manifest, "was brought back"
    counts = f"{found.count('traces')} traces, {found.count('models')} models, {found.size / 1e6:.1f} MB"
    print(f"{file} of {found.created:%Y-%m-%d %H:%M:%S %Z} {what}: {counts}")
