"""What the tests of the BBC Micro's bridge need beyond the project: make, ca65 and ld65 to build it, py65 to run it."""

import shutil
from importlib.util import find_spec

import pytest


def require() -> None:
    """Skips the module that calls it, in one line, where something is missing. Where CI is set, a skip is an error."""
    packages = {"make": "make", "ca65": "cc65", "ld65": "cc65"}
    missing = [f"{program} (Debian's {package})" for program, package in packages.items() if not shutil.which(program)]
    missing += ["py65 (a Python package)"] if find_spec("py65") is None else []
    if missing:
        pytest.skip(f"the BBC Micro's bridge needs {', '.join(missing)}", allow_module_level=True)
