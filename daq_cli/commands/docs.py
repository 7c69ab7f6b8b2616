"""`daq docs`: opens the documentation in the browser."""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import Annotated

import typer

from daq.contracts.errors import SpecError
from daq_cli.app.context import console

app = typer.Typer(add_completion=False)


@app.command()
def docs(
    path: Annotated[bool, typer.Option("--path", help="Print where its first page lies; open nothing.")] = False,
) -> None:
    """Open the documents in the browser: guides, reference, gallery, glossary; without a network."""
    import webbrowser

    from daq.config.documents import site_index

    index = site_index() or _written()
    if path:
        print(index)
    elif not webbrowser.open(index.as_uri()):
        console().print("no browser was found; this is the first page:")
        print(index)


def _written() -> Path:
    """First page of the documentation, rendered into this user's cache or, if that fails, beside the temporary
    files."""
    import platformdirs

    from daq.config.documents import documents

    try:
        return documents().write(platformdirs.user_cache_path("ma2000-daq") / "documents")
    except (OSError, RuntimeError):  # also a user without a home folder
        try:
            return documents().write(Path(tempfile.mkdtemp(prefix="ma2000-documents-")))
        except OSError as error:
            raise SpecError(f"the documents cannot be written to {tempfile.gettempdir()}: {error.strerror}") from error
