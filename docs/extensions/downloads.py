"""Every notebook of the gallery as a file beside its page, without outputs, for whoever has the site alone."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import jupytext
from sphinx.application import Sphinx

END_OF_TITLE = "</h1>"


def is_notebook(pagename: str) -> bool:
    """Whether a page of the site is a notebook."""
    return pagename.startswith("gallery/") and pagename != "gallery/index"


def _offer(app: Sphinx, pagename: str, templatename: str, context: dict[str, Any], doctree: object) -> None:
    """Writes the notebook, and puts a link to it below the title."""
    del templatename, doctree
    if not is_notebook(pagename) or app.builder.format != "html":
        return
    file = Path(app.outdir) / f"{pagename}.ipynb"
    file.parent.mkdir(parents=True, exist_ok=True)
    jupytext.write(jupytext.read(Path(app.srcdir) / f"{pagename}.md"), file)
    link = f'<p><a href="{file.name}" download>Download this notebook</a> ({file.name}, without outputs)</p>'
    before, end, after = context["body"].partition(END_OF_TITLE)
    context["body"] = f"{before}{end}{link}{after}"


def setup(app: Sphinx) -> dict[str, bool]:
    """Registers the handler."""
    app.connect("html-page-context", _offer)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
