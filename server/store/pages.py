"""Lists in parts: a cursor is where the next part begins, in the order of the list, so nothing is left out or doubled
when rows come and go meanwhile."""

from __future__ import annotations

import base64
import binascii
import json
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from typing import Any, Self, TypeVar

from sqlalchemy import Select
from sqlalchemy.orm import InstrumentedAttribute

from daq.contracts.service.base import Page
from server.problems import ProblemError
from server.store.engine import Store

Row = TypeVar("Row")
Item = TypeVar("Item")


@dataclass(frozen=True)
class Cursor:
    """The last row of a part: its number, or moment, and where rows have no number their identity."""

    number: float
    identity: str = ""

    def __str__(self) -> str:
        return base64.urlsafe_b64encode(json.dumps([self.number, self.identity]).encode()).decode()

    @classmethod
    def parse(cls, text: str) -> Self:
        """Raises a 422 for anything that no list gave out."""
        try:
            number, identity = json.loads(base64.urlsafe_b64decode(text.encode()))
            if isinstance(number, int | float) and isinstance(identity, str) and abs(number) < 2**62:
                return cls(number, identity)
        except (ValueError, TypeError, binascii.Error):
            pass
        raise ProblemError(422, "not-valid", "cursor: not one that a list returned", "begin without a cursor")

    @property
    def moment(self) -> datetime:
        """The number of a list by time; the routes take no cursor whose number is none (`CursorOf`)."""
        return datetime.fromtimestamp(self.number, UTC)


def page_of(
    rows: Sequence[Row], limit: int, convert: Callable[[Row], Item], place: Callable[[Row], Cursor]
) -> Page[Item]:
    """A part made of up to `limit` rows; one row more than that says that there is another part."""
    shown = rows[:limit]
    following = str(place(shown[-1])) if len(rows) > limit and shown else None
    return Page(items=tuple(convert(row) for row in shown), next=following)


def newest_first(
    store: Store,
    query: Select[Any],
    number: InstrumentedAttribute[int],
    cursor: str | None,
    limit: int,
    convert: Callable[[Row], Item],
) -> Page[Item]:
    """A part of what `query` finds, by falling `number`: one that grows with every row, whatever clocks do."""
    query = query.order_by(number.desc())
    if cursor is not None:
        query = query.where(number < Cursor.parse(cursor).number)
    with store.reading() as session:
        rows = list(session.scalars(query.limit(limit + 1)))
    return page_of(rows, limit, convert, lambda row: Cursor(getattr(row, number.key)))
