"""A Python in which the packages of some extras are missing, for tests of what it says then."""

import json
import os
import subprocess
import sys
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from daq.contracts.extras import CONTAINS, EXTRA_OF, Extra
from tests.repository.tracked import ROOT

_PROGRAM = """
import json, sys
from importlib.machinery import PathFinder

class Without(PathFinder):
    @classmethod
    def find_spec(cls, name, path=None, target=None):
        return None if name.partition(".")[0] in hidden else PathFinder.find_spec(name, path, target)

hidden = set(json.loads(sys.argv[1]))
sys.meta_path[sys.meta_path.index(PathFinder)] = Without
sys.argv = ["daq"]
exec(compile(sys.stdin.read(), "program", "exec"), {"__name__": "program"})
"""


def packages_beyond(*extras: Extra) -> list[str]:
    """The packages that an installation with these extras lacks."""
    installed = {*extras, *(one for extra in extras for one in CONTAINS.get(extra, ()))}
    return [package for package, extra in EXTRA_OF.items() if extra not in installed]


def run_without(packages: Iterable[str], program: str, folder: Path) -> Any:
    """What a program prints last, as JSON, in a Python that cannot import these packages."""
    done = subprocess.run(
        [sys.executable, "-c", _PROGRAM, json.dumps(list(packages))],
        input=program,
        cwd=folder,
        env=os.environ
        | {"PYTHONPATH": str(ROOT), "XDG_CONFIG_HOME": str(folder), "DAQ_RUNTIME_FOLDER": str(folder / "run")},
        capture_output=True,
        text=True,
        check=False,
        timeout=60,
    )
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout.splitlines()[-1])
