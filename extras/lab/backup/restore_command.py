"""`daq restore`: writes a backup to the configured paths."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

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
    from extras.lab.backup.archive import places_of, verify
    from extras.lab.backup.archive import restore as bring_back
    from extras.lab.backup.backup_command import counted
    from server.clock import SystemClock

    put_aside: tuple[Path, ...] = ()
    if check:
        entries, what = verify(file), "is as it was written"
    else:
        places = places_of(invocation(context).configuration)
        with shown_progress("restore") as progress:
            entries, put_aside = bring_back(file, places, SystemClock().utc(), progress, overwrite=overwrite)
        what = "was restored"
    found = counted(entries)
    if json:
        print_json({"file": file, "restored": not check, "put_aside": [str(one) for one in put_aside], **found})
        return
    for folder in put_aside:
        console().print(f"existing data were moved to {folder}", markup=False)
    print(f"{file} {what}: {found['traces']} traces, {found['models']} models, {found['bytes'] / 1e6:.1f} MB")
