"""The site of the documents: `make docs` builds it into docs/_site. Nothing is fetched from the network."""

from __future__ import annotations

import sys
from importlib.metadata import version as version_of
from pathlib import Path

DOCS = Path(__file__).parent
sys.path[:0] = [str(DOCS.parent), str(DOCS)]

project = "MA2000 DAQ"
author = "the authors of MA2000 DAQ"
version = release = version_of("ma2000-daq")
language = "en"

extensions = [
    "myst_nb",  # Markdown, and the notebooks of the gallery; brings myst_parser
    "sphinx.ext.autodoc",
    "sphinx.ext.napoleon",
    "extensions.pages",
    "extensions.downloads",
    "extensions.public_api",
    "extensions.snippets",
    "extensions.policy",
]
exclude_patterns = ["_site", "extensions", "**/.ipynb_checkpoints"]
nitpicky = True

myst_enable_extensions = ["deflist", "html_image"]
myst_heading_anchors = 5
highlight_language = "text"
suppress_warnings = ["misc.highlighting_failure"]  # an ellipsis in C or JSON
smartquotes = False  # they would make one dash of the two of an option

autodoc_member_order = "bysource"
autodoc_typehints_format = "short"
python_use_unqualified_type_names = True
python_maximum_signature_line_length = 88
add_module_names = False
default_role = "code"  # one pair of backticks in a docstring is code, as in Markdown
napoleon_google_docstring = napoleon_numpy_docstring = False  # extensions/public_api.py asks it where it applies

nb_execution_mode = "cache"  # `make docs` runs a notebook again only when it has changed
nb_execution_cache_path = str(DOCS.parent / "build" / "docs" / "notebooks")
nb_execution_in_temp = True  # a notebook's traces do not stay beside it
nb_execution_timeout = 600
nb_execution_raise_on_error = True
nb_merge_streams = True

html_theme = "furo"
html_title = "MA2000 DAQ"
html_static_path = ["static"]
html_css_files = ["site.css"]
html_favicon = "../server/dashboard/public/icon.svg"
html_copy_source = False
html_show_copyright = False
html_show_sphinx = False
html_theme_options = {"navigation_with_keys": True}
