"""`daq docs`: the site of the documents, in the browser."""

from __future__ import annotations

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

    from daq.config.documents import NOT_BUILT, site_index

    index = site_index()
    if index is None:
        raise SpecError(NOT_BUILT)
    if path:
        print(index)
    elif not webbrowser.open(index.as_uri()):
        console().print("no browser was found; this is the first page:")
        print(index)
