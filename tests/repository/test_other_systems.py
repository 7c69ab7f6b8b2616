"""What needs no serial port works on macOS and Windows too, as far as Linux can tell."""

import os
import subprocess
import sys

import pytest

from tests.repository.at_the_desk import OURS
from tests.repository.tracked import ROOT


@pytest.mark.timeout(300)
def test_records_are_imported_and_diagnosed_without_what_windows_lacks() -> None:
    script = str(ROOT / "tests" / "repository" / "at_the_desk.py")
    done = subprocess.run(
        [sys.executable, "-X", "warn_default_encoding", script, "--as-windows"],
        cwd=ROOT,
        capture_output=True,
        encoding="cp1252",  # the usual one of a window there
        errors="replace",
        env=os.environ | {"PYTHONPATH": str(ROOT), "PYTHONIOENCODING": "cp1252"},
        check=False,
    )
    assert done.returncode == 0, done.stderr


@pytest.mark.slow
@pytest.mark.timeout(900)
@pytest.mark.parametrize("system", ["win32", "darwin"])
def test_types_are_right_there(system: str) -> None:
    packages = [word for package in OURS for word in ("-p", package)]
    command = ["-m", "mypy", "--no-error-summary", "--follow-imports", "silent", "--platform", system]
    cache = f"--cache-dir=.mypy_cache/{system}"
    done = subprocess.run([sys.executable, *command, cache, *packages], cwd=ROOT, capture_output=True, check=False)
    assert done.stdout.decode() == ""
