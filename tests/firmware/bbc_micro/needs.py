"""What the tests of the BBC Micro's bridge need beyond the project: ca65 and ld65 to build it, py65 to run it."""

from __future__ import annotations

import shutil
from importlib.util import find_spec

import pytest


def require() -> None:
    """Skips the module that calls it, in one line, where something is missing. Where CI is set, a skip is an error."""
    missing = [f"{program} (Debian's cc65)" for program in ("ca65", "ld65") if shutil.which(program) is None]
    missing += ["py65 (a Python package)"] if find_spec("py65") is None else []
    if missing:
        pytest.skip(f"the BBC Micro's bridge needs {', '.join(missing)}", allow_module_level=True)
