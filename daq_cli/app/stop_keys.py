"""Ctrl-C, Ctrl-Z and SIGTERM stop the arm while it moves."""

from __future__ import annotations

import signal
import sys
import threading
from abc import ABC, abstractmethod
from collections.abc import Callable
from types import FrameType, TracebackType
from typing import Self

STOP_SIGNALS = [signal.SIGINT, signal.SIGTERM]
"""Signals that stop the arm."""
if sys.platform != "win32":
    STOP_SIGNALS.append(signal.SIGTSTP)  # Ctrl-Z: an arm must not move on while its program is suspended
PRESSES_TO_LEAVE = 3
"""Presses of Ctrl-C that end the program even if the owner process does not answer."""


class StopKeys:
    """Within the block, every such signal calls the function passed to `stops`; a signal that came before calls it at
    once."""

    def __init__(self) -> None:
        self._stop: Callable[[], None] | None = None
        self._presses = 0
        self._before: dict[int, object] = {}

    def stops(self, stop: Callable[[], None]) -> None:
        """Sets the function that a signal calls. It must be quick, and may be called repeatedly."""
        self._stop = stop
        if self._presses:
            stop()

    def __enter__(self) -> Self:
        for number in STOP_SIGNALS:
            self._before[number] = signal.signal(number, self._pressed)
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        for number, handler in self._before.items():
            signal.signal(number, handler)  # type: ignore[arg-type]

    def _pressed(self, _number: int, _frame: FrameType | None) -> None:
        self._presses += 1
        if self._stop is not None:
            self._stop()
        if self._presses >= PRESSES_TO_LEAVE:
            raise KeyboardInterrupt


class StopThread(ABC):
    """A thread that carries out a stop key's request if that may take longer than a signal handler may: at a
    service."""

    def __init__(self) -> None:
        self.pressed = False
        self._wake = threading.Event()
        self._thread = threading.Thread(target=self._wait, name="stop-keys", daemon=True)

    def __enter__(self) -> Self:
        self._thread.start()
        return self

    def press(self) -> None:
        """Notes a stop key. Called by a signal handler, so it is quick, and may be called again."""
        if not self.pressed:  # a signal within this one would find the lock taken, and need not wake the thread again
            self.pressed = True
            self._wake.set()

    @abstractmethod
    def _wait(self) -> None:
        """The thread's function: waits for `_wake`."""
