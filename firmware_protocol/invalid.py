"""Extracts one-line errors from pydantic's. It is in this package because every package that reads files is above
it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from pydantic import ValidationError


LONGEST_KEY = 60
"""Most characters of a key; the longest of this project have half as many."""
LONGEST = 400
"""Most characters of a message; the longest of this project, with a list of allowed values, have half as many."""


@dataclass(frozen=True)
class Invalid:
    """A value that a data model rejected.

    place:   keys and indices that lead to it, from the outermost; a long key of a file is shortened
    message: the error, or what is allowed
    kind:    pydantic's name of the violated rule
    bounds:  the exceeded bounds, by pydantic's name of each (`ge`, `le`)
    """

    place: tuple[int | str, ...]
    message: str
    value: Any
    kind: str
    bounds: Mapping[str, Any]

    def where(self, whole: str = "", first: int = 0) -> str:
        """Returns the place with dots, its indices counted from `first`; `whole` if the error concerns all of the
        data."""
        return ".".join(str(part + first if isinstance(part, int) else part) for part in self.place) or whole


def first_invalid(error: ValidationError) -> Invalid:
    """Returns the first rejected value of `error`."""
    return invalid_of(error.errors()[0])


def invalid_of(error: Mapping[str, Any]) -> Invalid:
    """Converts one of pydantic's errors."""
    place = tuple(part if isinstance(part, int) else _short(part, LONGEST_KEY) for part in error["loc"])
    return Invalid(place, message_of(error), error["input"], error["type"], error.get("ctx", {}))


def message_of(error: Mapping[str, Any]) -> str:
    """Returns the message of one of pydantic's errors, without its prefix for errors of validators."""
    return _short(str(error["msg"]).removeprefix("Value error, "), LONGEST)


def _short(text: str, most: int) -> str:
    """Returns a text in one line; of a long one, which may come from a file, the middle is left out."""
    line = " ".join(text.split()) if "\n" in text else text
    return line if len(line) <= most else f"{line[: most // 2]} … {line[-most // 2 :]}"
