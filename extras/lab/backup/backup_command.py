"""`daq backup`: writes all data of a service into one file."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated
from zipfile import ZipInfo

import typer

from daq_cli.app.context import JsonOption, invocation, print_json

app = typer.Typer(add_completion=False)


@app.command()
def backup(
    context: typer.Context,
    file: Annotated[Path, typer.Argument(help="The .zip file to write; it must not exist yet.")],
    json: JsonOption = False,
) -> None:
    """Copy the service's database, traces, models and results into one file, also while the service runs."""
    from daq_cli.app.progress import shown_progress
    from extras.lab.backup.archive import back_up, places_of, verify

    with shown_progress("backup") as progress:
        back_up(places_of(invocation(context).configuration), file, progress)
    found = counted(verify(file))
    if json:
        print_json({"file": file, **found})
        return
    print(f"{file}: {found['traces']} traces, {found['models']} models, {found['bytes'] / 1e6:.1f} MB")


def counted(entries: Sequence[ZipInfo]) -> dict[str, int]:
    """Returns the size of a backup's files (bytes), and the numbers of its traces and models."""
    kinds = {kind: sum(entry.filename.startswith(f"{kind}/") for entry in entries) for kind in ("traces", "models")}
    return {"bytes": sum(entry.file_size for entry in entries), **kinds}
