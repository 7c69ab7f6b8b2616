"""`daq restore`: writes a backup to the configured paths."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from daq.contracts.errors import SpecError
from daq_cli.app.context import JsonOption, console, invocation, print_json

app = typer.Typer(add_completion=False)


@app.command()
def restore(
    context: typer.Context,
    file: Annotated[Path, typer.Argument(help="A file that `daq backup` made.")],
    check: Annotated[bool, typer.Option("--check", help="Read every byte of the backup, and change nothing.")] = False,
    overwrite: Annotated[
        bool, typer.Option("--overwrite", help="Move existing data aside, into folders before-restore-….")
    ] = False,
    json: JsonOption = False,
) -> None:
    """Restore the database, traces, models and results of a backup. The service must not run."""
    from daq_cli.app.progress import shown_progress
    from extras.lab.backup.manifest import verify
    from extras.lab.backup.places import places_of
    from extras.lab.backup.restore import restore as bring_back
    from server.clock import SystemClock

    if file.exists() and not file.is_file():
        raise SpecError(f"{file}: is not a file, so not a backup")
    put_aside: list[str] = []
    removed: tuple[str, ...] = ()
    if check:
        with shown_progress("checking") as progress:
            found = verify(file, progress)
        what = "is as it was written"
    else:
        places = places_of(invocation(context).configuration)
        with shown_progress("restore") as progress:
            done = bring_back(file, places, SystemClock().utc(), progress, overwrite=overwrite)
        put_aside, removed = [str(folder) for folder in done.put_aside], done.removed
        found, what = done.manifest, "was restored"
    if json:
        counted = {"bytes": found.size, "traces": found.count("traces"), "models": found.count("models")}
        manifest = found.model_dump(mode="json", exclude={"files"})
        print_json(
            {"file": file, "restored": not check, "put_aside": put_aside, "removed": removed, **manifest, **counted}
        )
        return
    for folder in put_aside:
        console().print(f"existing data were moved to {folder}", markup=False)
    for name in removed:
        console().print(f"not restored, since this program does not make it: {name} of the database", markup=False)
    counts = f"{found.count('traces')} traces, {found.count('models')} models, {found.size / 1e6:.1f} MB"
    print(f"{file} of {found.created:%Y-%m-%d %H:%M:%S %Z} {what}: {counts}")
