"""How a long computation reports and how it is cancelled: `f(inputs, progress, cancel) → typed result`."""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

Progress = Callable[[float, str], None]
"""Called with the fraction done (0 to 1) and one line that says what is being done."""


class Cancel(Protocol):
    """Anything with `is_set()`, such as `threading.Event`."""

    def is_set(self) -> bool:
        """Whether the computation should end now."""
        ...


class CancelledError(Exception):
    """The computation ended early because it was asked to."""


def stop_if(cancel: Cancel) -> None:
    """Raises CancelledError when the computation is to end."""
    if cancel.is_set():
        raise CancelledError("it was cancelled")


class Never:
    """A `Cancel` that is never set."""

    def is_set(self) -> bool:
        """Always False."""
        return False


def silent(_fraction: float, _text: str) -> None:
    """A `Progress` that does nothing."""
