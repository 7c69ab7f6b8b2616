"""A real object to which something happens at a chosen call: what another thread does, a disk that is full."""

from collections.abc import Callable
from typing import Any

Happening = Callable[[], object]


class Meanwhile:
    """Passes every call on to `real`. What `before` and `after` name happens around the next call of that method, once
    for each time that it was named; a happening that raises makes the call raise."""

    def __init__(self, real: object) -> None:
        self._real = real
        self._before: dict[str, list[Happening]] = {}
        self._after: dict[str, list[Happening]] = {}

    def before(self, method: str, *happenings: Happening) -> None:
        """Each of these comes before a call of its own of `method`."""
        self._before.setdefault(method, []).extend(happenings)

    def after(self, method: str, *happenings: Happening) -> None:
        """Each of these comes after a call of its own of `method`."""
        self._after.setdefault(method, []).extend(happenings)

    def __getattr__(self, name: str) -> Any:
        found = getattr(self._real, name)
        if name not in self._before and name not in self._after:
            return found

        def called(*args: Any, **named: Any) -> Any:
            _next(self._before, name)
            answer = found(*args, **named)
            _next(self._after, name)
            return answer

        return called


def raising(error: Exception) -> Happening:
    """A happening that raises."""

    def fails() -> None:
        raise error

    return fails


def _next(happenings: dict[str, list[Happening]], name: str) -> None:
    if happenings.get(name):
        happenings[name].pop(0)()
