"""Detects a file of the user that hides one of this project's packages, which have short names."""

from __future__ import annotations

from importlib.util import find_spec
from pathlib import Path

PACKAGES = ("daq", "extras", "firmware_protocol", "mock_controller", "model", "server")


class HiddenPackageError(ImportError):
    """A module or folder earlier on Python's path has the name of a package of this project."""


def require_own_packages() -> None:
    """Raises HiddenPackageError, with one line that names the file, if a package is hidden."""
    home = Path(__file__).resolve().parents[1]
    for name in PACKAGES:
        found = _place_of(name)
        if found is not None and found != home / name:
            raise HiddenPackageError(
                f"{found}: has the name of the package {name!r} of ma2000-daq and comes before it on Python's path; "
                "rename it, or start Python in another folder"
            )


def _place_of(name: str) -> Path | None:
    """The package folder or module file that Python would import for a name; None if there is none."""
    spec = find_spec(name)
    if spec is None:
        return None
    if spec.submodule_search_locations is None:
        return Path(spec.origin or "").resolve()
    return Path(next(iter(spec.submodule_search_locations))).resolve()
