"""Pages that are made while the site is built, and links that are mended for it.

A page of GENERATED has its text made from the code; one of BROUGHT is a page that lies elsewhere in the repository.
The files that stand for them in docs/ say in one line where to look without the site.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from docutils import nodes
from sphinx.application import Sphinx

from daq.config.documents import BROUGHT, brought

from . import command_line, configuration, machine_file, mock_effects, public_api, rest

ROOT = Path(__file__).parents[2]
GENERATED: dict[str, Callable[[], str]] = {
    "machine-file": machine_file.page,
    "reference/options": command_line.page,
    "reference/configuration": configuration.page,
    "reference/mock-effects": mock_effects.page,
    "reference/rest": rest.operations_page,
    "reference/rest-schemas": rest.schemas_page,
    "reference/python-api": public_api.page,
}
LONGEST_WHOLE = 28
"""Most characters of code that a phone shows in one line beside a bullet."""
BELOW = {"decisions/README": "0*"}
"""Pages that have others below them, by pattern."""


def _read(app: Sphinx, docname: str, source: list[str]) -> None:
    del app
    if docname in GENERATED:
        source[0] = GENERATED[docname]()
    else:
        text = (ROOT / BROUGHT[docname]).read_text("utf-8") if docname in BROUGHT else source[0]
        if not docname.startswith("gallery/"):
            text = brought(docname, text)
        source[0] = text
    if docname in BELOW:
        source[0] += f"\n\n```{{toctree}}\n:hidden:\n:glob:\n\n{BELOW[docname]}\n```\n"


def _short_code(app: Sphinx, doctree: nodes.document, docname: str) -> None:
    """Marks code that is to stay in one line: an option would be broken after its dashes."""
    del app, docname
    for code in doctree.findall(nodes.literal):
        if len(code.astext()) <= LONGEST_WHOLE and " " not in code.astext():
            code["classes"].append("whole")


def _changed(app: Sphinx, *_: object) -> list[str]:
    """Pages whose source is not the file in docs/ are read at every build."""
    return [name for name in (*GENERATED, *BROUGHT) if name in app.env.found_docs]


def _outputs(app: Sphinx) -> None:
    """Keeps what notebooks draw out of the folder of the pages, where myst-nb would write it beside the site."""
    folder = str(Path(app.doctreedir).parent / "outputs")
    app.env.mystnb_config = app.env.mystnb_config.copy(output_folder=folder)  # type: ignore[attr-defined]


def setup(app: Sphinx) -> dict[str, bool]:
    """Registers the handlers."""
    app.connect("builder-inited", _outputs, priority=900)
    app.connect("source-read", _read)
    app.connect("env-get-outdated", _changed)
    app.connect("doctree-resolved", _short_code)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
