"""Ctrl-C, Ctrl-Z and a polite kill while an arm moves: each of them stops the arm."""

from __future__ import annotations

import signal
from collections.abc import Callable
from types import FrameType, TracebackType
from typing import Self

STOP_SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGTSTP)
"""SIGTSTP is Ctrl-Z: an arm does not go on moving behind a terminal that has been put aside."""
PRESSES_TO_LEAVE = 3
"""Ctrl-C so often leaves, even when the acquisition process no longer answers."""


class StopKeys:
    """While entered, every such signal calls what `stops` was given; one that came before is made up for then."""

    def __init__(self) -> None:
        self._stop: Callable[[], None] | None = None
        self._presses = 0
        self._before: dict[int, object] = {}

    def stops(self, stop: Callable[[], None]) -> None:
        """What a signal does: it must be quick, and must bear being called again and again."""
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
