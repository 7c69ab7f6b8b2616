"""What pydantic refused, for an error of one line. It is here because every package that reads files is above."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from pydantic import ValidationError


@dataclass(frozen=True)
class Invalid:
    """The first value that a data model refused.

    place:   keys and indices that lead to it, from the outermost
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
    return Invalid(error["loc"], message_of(error), error["input"], error["type"], error.get("ctx", {}))


def message_of(error: Mapping[str, Any]) -> str:
    """The message of one of pydantic's errors, without the words that it puts before those of a validator."""
    return str(error["msg"]).removeprefix("Value error, ")
