"""Distributions of this tree, and fresh environments that they are installed into."""

import os
import shutil
import subprocess
import sys
import tarfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import pytest

from tests.repository.tracked import ROOT

VERSIONS = ("3.11", "3.12", "3.13")
UV = Path(sys.executable).with_name("uv")
NOT_REACHED = ("Failed to fetch", "error sending request", "dns error")
"""What uv says where no package index can be reached."""


@dataclass(frozen=True)
class Distributions:
    """The two files that a release uploads."""

    wheel: Path
    sdist: Path


def build(folder: Path, tree: Path = ROOT) -> Distributions:
    """Builds both from a tree, with the build requirements of the environment of development."""
    command = [sys.executable, "-m", "hatchling", "build", "--directory", str(folder)]
    subprocess.run(command, cwd=tree, check=True, capture_output=True, timeout=300)
    (wheel,), (sdist,) = folder.glob("*.whl"), folder.glob("*.tar.gz")
    return Distributions(wheel, sdist)


def unpacked(sdist: Path, folder: Path) -> Path:
    """The tree in a source distribution."""
    with tarfile.open(sdist) as archive:
        archive.extractall(folder, filter="data")
    (tree,) = folder.iterdir()
    return tree


def pythons() -> Iterator[tuple[str, Path]]:
    """The supported versions of Python that this machine has, by their number."""
    pyenv = Path(os.environ.get("PYENV_ROOT", Path.home() / ".pyenv")) / "versions"
    for version in VERSIONS:
        if sys.version_info[:2] == tuple(map(int, version.split("."))):
            yield version, Path(sys.executable)
            continue
        found = [*sorted(pyenv.glob(f"{version}.*/bin/python{version}")), shutil.which(f"python{version}")]
        if one := next((path for path in found if path is not None), None):
            yield version, Path(one)


def installed(python: Path, requirement: str, folder: Path, pins: str = "requirements-dev.txt") -> Path:
    """Makes an environment, installs a requirement into it in the pinned versions, and returns its programs' folder.

    Skips the test where no package index is reached.
    """
    _uv("venv", "--python", str(python), str(folder))
    _uv("pip", "install", "--python", str(folder), "--constraint", str(ROOT / pins), requirement)
    return folder / "bin"


def run(command: list[str | Path], folder: Path, **environment: str) -> subprocess.CompletedProcess[str]:
    """Runs a program of such an environment in a folder, where nothing of this tree is found."""
    kept = {key: value for key, value in os.environ.items() if key != "PYTHONPATH" and not key.startswith("DAQ_")}
    return subprocess.run(
        [str(word) for word in command],
        cwd=folder,
        env=kept | {"XDG_CONFIG_HOME": str(folder), "DAQ_RUNTIME_FOLDER": str(folder / "run")} | environment,
        capture_output=True,
        text=True,
        check=False,
        timeout=110,
    )


def _uv(*arguments: str) -> None:
    done = subprocess.run([str(UV), "--quiet", *arguments], capture_output=True, text=True, check=False, timeout=600)
    if done.returncode and any(words in done.stderr for words in NOT_REACHED):
        pytest.skip("no package index is reached")
    assert done.returncode == 0, done.stderr
