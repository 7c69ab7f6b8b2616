"""Packages that only some users need, and the line that says how to install one that is missing."""

from __future__ import annotations

from importlib.util import find_spec
from typing import Literal

from daq.contracts.errors import DaqError
from daq.contracts.exit_codes import WRONG_INPUT

Extra = Literal["ros", "tables"]


class MissingExtraError(DaqError):
    """A package that is not installed, and that what was asked for needs."""

    exit_code = WRONG_INPUT


def require_extra(extra: Extra, what: str, *packages: str) -> None:
    """Raises MissingExtraError, with the command that installs it, where one of the packages of an extra is missing.

    Args:
        what: names what needs the packages; the error begins with it.
    """
    for package in packages:
        if find_spec(package) is None:
            raise MissingExtraError(f"{what} needs the package {package}: pip install ma2000-daq[{extra}]")
