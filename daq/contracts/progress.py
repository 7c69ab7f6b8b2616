"""Progress and cancellation of a long computation: `f(inputs, progress, cancel) → typed result`."""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

Progress = Callable[[float, str], None]
"""Called with the fraction done (0 to 1) and a line about the current step."""


class Cancel(Protocol):
    """Any object with `is_set()`, such as `threading.Event`."""

    def is_set(self) -> bool:
        """Whether the computation must end now."""
        ...


class CancelledError(Exception):
    """The computation was cancelled."""


def stop_if(cancel: Cancel) -> None:
    """Raises CancelledError if the computation must end."""
    if cancel.is_set():
        raise CancelledError("the computation was cancelled")


class Never:
    """A `Cancel` that is never set."""

    def is_set(self) -> bool:
        """Always False."""
        return False


def silent(_fraction: float, _text: str) -> None:
    """A `Progress` that does nothing."""


def rising(progress: Progress) -> Progress:
    """Returns a `Progress` whose fraction never falls, for a computation whose stages may be repeated."""
    most = 0.0

    def told(fraction: float, text: str) -> None:
        nonlocal most
        most = max(most, fraction)
        progress(most, text)

    return told
