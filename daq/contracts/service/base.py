"""Base classes of the service's models."""

from __future__ import annotations

from datetime import UTC, datetime
from typing import Annotated, Generic, TypeVar

from pydantic import AfterValidator, AwareDatetime, Field

from daq.contracts.frozen import FrozenRecord, UserRecord


class Wire(FrozenRecord):
    """A message of the service. Unknown fields are rejected, never ignored."""


class UserWire(Wire, UserRecord):
    """A message that users also construct in Python."""


def _has_utc(moment: datetime) -> datetime:
    try:
        moment.astimezone(UTC)
    except OverflowError:
        raise ValueError("lies outside the years 1 to 9999, UTC") from None
    return moment


Moment = Annotated[AwareDatetime, AfterValidator(_has_utc)]
"""A time from a client, with its time zone. Times are compared and stored in UTC."""
T = TypeVar("T")
PageLimit = Annotated[int, Field(ge=1, le=500)]


class Page(Wire, Generic[T]):
    """A part of a list. `next` is the cursor of the following part; None at the end."""

    items: tuple[T, ...]
    next: str | None = None
