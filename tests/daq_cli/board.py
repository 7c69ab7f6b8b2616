"""What the board holds, asked behind the command line's back."""

import os
import pty
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from daq.transport.mock_process import MockProcess
from tests.control_port import told_by


@contextmanager
def silent_port() -> Iterator[str]:
    """The name of a terminal at whose other end nobody answers."""
    master, slave = pty.openpty()
    try:
        yield os.ttyname(slave)
    finally:
        os.close(master)
        os.close(slave)


def ask(mock: MockProcess, do: str) -> dict[str, Any]:
    """The mock's control port."""
    return told_by(mock.control, do)


def held(mock: MockProcess) -> list[object]:
    """What no refused command may change: set points, gains, whether it is frozen."""
    state = ask(mock, "state")
    return [state[name] for name in ("set_points", "gains", "frozen")]
