"""The first act of `daq stop`: asks every process that moves a robot, before the command line is loaded."""

from __future__ import annotations

from daq.acquisition.stop_socket import StopAttempt, request_stop

_asked: list[StopAttempt] | None = None


def ask() -> None:
    """Stops every robot that this user's processes move, and keeps the answers for the subcommand."""
    global _asked  # noqa: PLW0603 - one process, one command line, one stop
    _asked = request_stop()


def attempts() -> list[StopAttempt]:
    """The answers to the early stop; stops now when there was none (`daq --config … stop`)."""
    return request_stop() if _asked is None else _asked
