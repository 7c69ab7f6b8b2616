"""Runs of pytest inside a test, under this repository's rules for tests."""

import os
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parents[2]


def command(folder: Path, *options: str) -> list[str]:
    """Run the tests of a folder."""
    rules = ["-p", "tests.conftest", "-p", "no:cacheprovider", "-c", str(ROOT / "pyproject.toml")]
    places = ["--rootdir", str(folder), "--lab-data", str(folder / "absent"), str(folder)]
    return [sys.executable, "-m", "pytest", *rules, *options, *places]


def run_folder(folder: Path, *options: str, ci: str = "") -> subprocess.CompletedProcess[str]:
    """Run the tests of a folder, and wait for the end."""
    return subprocess.run(
        command(folder, *options),
        cwd=folder,
        env=environment(ci=ci),
        capture_output=True,
        text=True,
        check=False,
        timeout=60,
    )


def environment(ci: str = "") -> dict[str, str]:
    """Where such a run finds the rules, and whether it is one of continuous integration."""
    return os.environ | {"CI": ci, "PYTHONPATH": str(ROOT), "COLUMNS": "200"}
