"""First step of `daq stop`: stops every local robot before the command line is loaded."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import zip_longest

from daq.owner.stop_socket import StopAnswer, StopAttempt, request_stop

_asked: list[StopAttempt] | None = None


def ask(arguments: Sequence[str] = ()) -> None:
    """Stops every robot that this user's processes move, and stores the answers for the subcommand. `arguments`: those
    after `stop`, which may name one robot."""
    global _asked  # noqa: PLW0603 - one process, one command line, one stop
    _asked = request_stop(_named(arguments)) or None  # no robot of this name: the subcommand handles that


def attempts(robot: str | None = None) -> list[StopAttempt]:
    """Returns the answers to the early stop; stops now if there was none (`daq --config … stop`)."""
    return request_stop(robot) if _asked is None else _asked


def told() -> list[str]:
    """One line per robot of the early stop, for a command line that cannot be loaded."""
    return [line_of(answer_of(attempt)) for attempt in _asked or []]


def answer_of(attempt: StopAttempt) -> StopAnswer:
    """Returns the answer to a stop; for a process that gave none, a text that states this."""
    silent = "the process that moves it did not answer"
    return attempt.answer or StopAnswer(robot=attempt.robot, delivered=False, confirmed=False, text=silent)


def line_of(answer: StopAnswer) -> str:
    """Returns the result of a stop in one line, for a person."""
    if answer.confirmed:
        line = f"{answer.robot}: stopped, confirmed by the board: set points frozen at tick {answer.tick}"
        return f"{line}. {answer.text}" if answer.text else line
    if answer.delivered:
        return f"{answer.robot}: stop sent, NOT CONFIRMED by the board: {answer.text}. Use the emergency stop."
    return f"{answer.robot}: stop NOT DELIVERED: {answer.text}. Use the emergency stop."


def _named(arguments: Sequence[str]) -> str | None:
    for one, after in zip_longest(arguments, arguments[1:]):
        name = after if one == "--robot" else one.removeprefix("--robot=") if one.startswith("--robot=") else None
        if name is not None:
            return name
    return None
