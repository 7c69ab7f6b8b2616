"""The first act of `daq stop`: asks every process that moves a robot, before the command line is loaded."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import zip_longest

from daq.acquisition.stop_socket import StopAttempt, request_stop

_asked: list[StopAttempt] | None = None


def ask(arguments: Sequence[str] = ()) -> None:
    """Stops every robot that this user's processes move, and keeps the answers for the subcommand. `arguments`: those
    behind `stop`, which may name one robot."""
    global _asked  # noqa: PLW0603 - one process, one command line, one stop
    _asked = request_stop(_named(arguments)) or None  # nobody by this name: the subcommand looks for what is meant


def attempts(robot: str | None = None) -> list[StopAttempt]:
    """The answers to the early stop; stops now when there was none (`daq --config … stop`)."""
    return request_stop(robot) if _asked is None else _asked


def _named(arguments: Sequence[str]) -> str | None:
    for one, after in zip_longest(arguments, arguments[1:]):
        name = after if one == "--robot" else one.removeprefix("--robot=") if one.startswith("--robot=") else None
        if name is not None:
            return name
    return None
