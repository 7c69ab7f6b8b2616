"""What pydantic refused, for an error of one line. It is here because every package that reads files is above."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from pydantic import ValidationError


LONGEST_KEY = 60
"""Most characters of a key; the longest of our own have half as many."""
LONGEST = 400
"""Most characters of a message; the longest of our own, with a list of what is allowed, has half as many."""


@dataclass(frozen=True)
class Invalid:
    """The first value that a data model refused.

    place:   keys and indices that lead to it, from the outermost; a key of a file that is long is shortened
    message: what is wrong with it, or what is allowed
    kind:    pydantic's name of the rule that it breaks
    bounds:  the bounds that it exceeds, by pydantic's name of each (`ge`, `le`)
    """

    place: tuple[int | str, ...]
    message: str
    value: Any
    kind: str
    bounds: Mapping[str, Any]

    def where(self, whole: str = "", first: int = 0) -> str:
        """The place with dots, its indices counted from `first`; `whole` where it is the data as a whole."""
        return ".".join(str(part + first if isinstance(part, int) else part) for part in self.place) or whole


def first_invalid(error: ValidationError) -> Invalid:
    """The first of the values that `error` is about."""
    return invalid_of(error.errors()[0])


def invalid_of(error: Mapping[str, Any]) -> Invalid:
    """One of pydantic's errors."""
    place = tuple(part if isinstance(part, int) else _short(part, LONGEST_KEY) for part in error["loc"])
    return Invalid(place, message_of(error), error["input"], error["type"], error.get("ctx", {}))


def message_of(error: Mapping[str, Any]) -> str:
    """The message of one of pydantic's errors, without the words that it puts before those of a validator."""
    return _short(str(error["msg"]).removeprefix("Value error, "), LONGEST)


def _short(text: str, most: int) -> str:
    """A text in one line; what is in its middle is left out where it is long, since a file may have written that."""
    line = " ".join(text.split()) if "\n" in text else text
    return line if len(line) <= most else f"{line[: most // 2]} … {line[-most // 2 :]}"
