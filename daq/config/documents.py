"""Where the site of the documents lies, which Sphinx has built (`make docs`)."""

from __future__ import annotations

from pathlib import Path

PLACES = (Path(__file__).parents[2] / "docs" / "_site", Path(__file__).parents[2] / "ma2000" / "docs_site")
"""In the source tree, and in an installed package (hatch_build.py)."""
INDEX = "index.html"
NOT_BUILT = (
    "the documents' site is not here: run `make docs` in the source tree, which builds it into docs/_site; "
    "what is installed from there afterwards has it, too"
)


def site_index() -> Path | None:
    """First page of the site; None where it is not built."""
    return next((place / INDEX for place in PLACES if (place / INDEX).is_file()), None)
