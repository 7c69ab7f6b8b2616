"""Optional packages, and the error message with the command that installs a missing one.

pyproject.toml lists the packages of each extra; docs/installing.md explains who needs which.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from importlib.util import find_spec
from typing import Literal

from daq.contracts.errors import DaqError
from daq.contracts.exit_codes import WRONG_INPUT

Extra = Literal[
    "live",
    "robot",
    "model",
    "server",
    "tables",
    "ros",
    "mcp",
    "webrtc",
]

CONTAINS: dict[Extra, tuple[Extra, ...]] = {
    "robot": ("live",),
    "model": ("robot", "live"),
    "server": ("robot", "live"),
    "mcp": ("robot", "live"),
    "webrtc": ("server", "robot", "live"),
}
"""Extras that an extra includes."""
EXTRA_OF: dict[str, Extra] = {
    "websockets": "live",
    "jinja2": "robot",
    "markdown_it": "robot",
    "matplotlib": "robot",
    "mujoco": "robot",
    "platformdirs": "robot",
    "pydantic_settings": "robot",
    "rich": "robot",
    "scipy": "robot",
    "serial": "robot",
    "typer": "robot",
    "numba": "model",
    "PIL": "server",
    "cronsim": "server",
    "fastapi": "server",
    "httptools": "server",
    "prometheus_client": "server",
    "sqlalchemy": "server",
    "starlette": "server",
    "tzlocal": "server",
    "uvicorn": "server",
    "uvloop": "server",
    "pandas": "tables",
    "pyarrow": "tables",
    "xarray": "tables",
    "rosbags": "ros",
    "google": "ros",
    "mcp": "mcp",
    "aiortc": "webrtc",
}
"""The smallest extra that installs each module."""


class MissingExtraError(DaqError):
    """A package that this operation needs is not installed."""

    exit_code = WRONG_INPUT


def require_extra(extra: Extra, what: str, *packages: str) -> None:
    """Raises MissingExtraError, with the command to install it, if a package of an extra is missing.

    Args:
        what: the feature that needs the packages; the error begins with it.
    """
    for package in packages:
        if not is_installed(package):
            raise _missing(what, package, extra)


@contextmanager
def missing_extras_named(what: str, extra: Extra | None = None) -> Iterator[None]:
    """Turns the failed import of an extra's package into MissingExtraError. Other failed imports are raised unchanged.

    Args:
        what: the feature in use; the error begins with it.
        extra: the extra that the whole feature needs. It is named instead of a smaller one, which would not suffice.
    """
    try:
        yield
    except ModuleNotFoundError as error:
        package = (error.name or "").partition(".")[0]
        smallest = EXTRA_OF.get(package)
        if smallest is None or is_installed(package):
            raise
        suffices = extra is not None and smallest in CONTAINS.get(extra, ())
        raise _missing(what, package, extra if extra is not None and suffices else smallest) from None


def is_installed(package: str) -> bool:
    """Whether a package can be imported. It is not imported."""
    return find_spec(package) is not None


def _missing(what: str, package: str, extra: Extra) -> MissingExtraError:
    return MissingExtraError(f"{what} needs the package {package}: pip install 'ma2000-daq[{extra}]'")
