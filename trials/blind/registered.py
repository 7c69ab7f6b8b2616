"""Compares a registration file with the present source tree, and finds the commit that registered it."""

from __future__ import annotations

import subprocess
from collections.abc import Iterable
from hashlib import sha256
from importlib.metadata import version
from pathlib import Path

import daq
from daq.contracts.documents import read_text
from daq.contracts.errors import SpecError
from trials.blind.registration import Registration, parse_registration

REGISTERED = (
    "model/discrepancy/thresholds.py",
    "model/discrepancy",
    "model/arrays.py",
    "model/blocks.py",
    "model/layout.py",
    "model/effects",
    "model/inverse_dynamics",
    "model/simulation",
    "model/fitting",
    "model/machine_model",
    "model/record_check",
    "model/dynamics",
    "model/drives",
    "model/kinematics",
    "model/design",
    "model/validation",
    "model/trial",
    "model/units.py",
    "mock_controller",
    "firmware_protocol",
    "daq/contracts",
    "daq/plugins.py",
    "daq/child.py",
    "daq/driver",
    "daq/trajectories",
    "daq/runner",
    "daq/traces",
    "daq/owner",
    "daq/teaching",
    "daq/link",
    "daq/transport",
    "daq/safety",
    "trials/blind",
)
"""Parts of the source tree that determine the outcome. A test follows the imports of every stage and finds them all
here."""
LIBRARIES = ("numpy", "scipy", "numba", "mujoco")
"""Libraries whose numerical results determine the outcome."""
_SUFFIXES = (".py", ".toml", ".json", ".csv")


def source_tree() -> Path:
    """Returns the folder that holds the packages."""
    return Path(daq.__file__).resolve().parents[1]


def tree_hashes(paths: Iterable[str] = REGISTERED) -> dict[str, str]:
    """Returns SHA-256 of files, and of all source files in folders with their names, by path. Raises SpecError."""
    root = source_tree()
    return {path: _hash(root, root / path) for path in paths}


def library_versions() -> dict[str, str]:
    """Returns the installed versions of the libraries, by name."""
    return {name: version(name) for name in LIBRARIES}


def to_register() -> str:
    """Returns the hashes and versions of the present code, as the last tables of a registration file."""
    hashes = [f'"{path}" = "{digest}"' for path, digest in tree_hashes().items()]
    versions = [f'{name} = "{found}"' for name, found in library_versions().items()]
    return "\n".join(["[hashes]", *hashes, "", "[versions]", *versions])


def _hash(root: Path, path: Path) -> str:
    if path.is_file():
        return sha256(path.read_bytes()).hexdigest()
    if not path.is_dir():
        raise SpecError(f"{path}: this registered path does not exist")
    found = sha256()
    files = (file for file in path.rglob("*") if file.suffix in _SUFFIXES and "__pycache__" not in file.parts)
    for file in sorted(files):
        found.update(f"{file.relative_to(root).as_posix()}\0{sha256(file.read_bytes()).hexdigest()}\n".encode())
    return found.hexdigest()


def published_table(path: Path, run: str) -> Path:
    """Returns the path of the table of a registration's run, beside the registration."""
    return path.with_name(f"{path.stem}-{run}.md")


def read_registration(path: Path, run: str) -> tuple[Registration, str]:
    """Returns the registration and the commit that last changed it.

    Raises SpecError unless three conditions hold: it is committed unchanged; it registers all code and libraries that
    determine the outcome, unchanged; and there is no table of this run beside it yet.
    """
    registration = parse_registration(read_text(path, f"registration {path}"), str(path))
    table = published_table(path, run)
    if table.exists():
        raise SpecError(
            f"{table}: this run has already been made; another one needs its own registration, with new seeds"
        )
    paths = dict.fromkeys((*REGISTERED, *registration.hashes))
    registration.check_code(tree_hashes(paths), library_versions(), str(path))
    return registration, registering_commit(path)


def registering_commit(path: Path) -> str:
    """Returns the commit that last changed a registration. Raises SpecError unless it is committed unchanged."""
    if _git(path, "status", "--porcelain", "--", path.name):
        raise SpecError(f"registration {path}: has uncommitted changes; the commit's hash draws the seeds")
    commit = _git(path, "log", "-1", "--format=%H", "--", path.name)
    if not commit:
        raise SpecError(f"registration {path}: is in no commit; its hash draws the seeds")
    return commit


def _git(path: Path, *arguments: str) -> str:
    try:
        done = subprocess.run(
            ["git", *arguments], cwd=path.resolve().parent, capture_output=True, text=True, check=True
        )
    except (OSError, subprocess.CalledProcessError) as error:
        raise SpecError(f"registration {path}: its commit cannot be read: {error}") from error
    return done.stdout.strip()
