"""Reads single keys of a terminal without waiting."""

from __future__ import annotations

import os
import select
import sys
from collections.abc import Iterator
from contextlib import contextmanager

from daq.contracts.errors import SpecError

LEFT, RIGHT = "\x1b[D", "\x1b[C"


@contextmanager
def open_keyboard() -> Iterator[Keyboard]:
    """Opens the terminal's keys; restores its mode at the end. Raises SpecError without a terminal.

    Ctrl-C stays a signal: it must stop the arm whatever this program does.
    """
    if not sys.stdin.isatty():
        raise SpecError("jogging needs a terminal: keys drive the arm; use `daq teach step` in scripts")
    if sys.platform == "win32":
        raise SpecError("jogging by keys needs Linux or macOS; use `daq teach step`")
    else:
        import termios
        import tty

        descriptor = sys.stdin.fileno()
        before = termios.tcgetattr(descriptor)
        try:
            tty.setcbreak(descriptor)
            yield Keyboard(descriptor)
        finally:
            termios.tcsetattr(descriptor, termios.TCSADRAIN, before)


class Keyboard:
    """Reads the keys pressed since the last read."""

    def __init__(self, descriptor: int) -> None:
        self._descriptor = descriptor

    def pressed(self) -> str:
        """Returns everything typed since the last read; empty if nothing was."""
        if not select.select([self._descriptor], [], [], 0)[0]:
            return ""
        return os.read(self._descriptor, 1024).decode("utf-8", "replace")
