"""Lists in pages. A cursor marks where the next page begins in the order of the list, so that no row is skipped or
repeated if rows are added or deleted meanwhile."""

from __future__ import annotations

import base64
import binascii
import json
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from typing import Any, Self, TypeVar

from sqlalchemy import Select, or_
from sqlalchemy.orm import InstrumentedAttribute

from daq.contracts.service.base import Page
from server.problems import ProblemError
from server.store.engine import Store

Row = TypeVar("Row")
Item = TypeVar("Item")


@dataclass(frozen=True)
class Cursor:
    """The last row of a page: its number; or, for rows without number, its time and ID."""

    number: float
    identity: str = ""

    def __str__(self) -> str:
        return base64.urlsafe_b64encode(json.dumps([self.number, self.identity]).encode()).decode()

    @classmethod
    def parse(cls, text: str) -> Self:
        """Parses a cursor. Raises a 422 for a text that no list returned."""
        try:
            number, identity = json.loads(base64.urlsafe_b64decode(text.encode()))
            if isinstance(number, int | float) and isinstance(identity, str) and abs(number) < 2**62:
                return cls(number, identity)
        except (ValueError, TypeError, binascii.Error):
            pass
        raise ProblemError(422, "not-valid", "cursor: not one that a list returned", "begin without a cursor")

    @property
    def moment(self) -> datetime:
        """The number as a time, for a list ordered by time. Routes reject cursors whose number is not a time
        (`CursorOf`)."""
        return datetime.fromtimestamp(self.number, UTC)


def page_of(
    rows: Sequence[Row], limit: int, convert: Callable[[Row], Item], place: Callable[[Row], Cursor]
) -> Page[Item]:
    """Makes a page from up to `limit` rows. One row more than `limit` means that another page follows."""
    shown = rows[:limit]
    following = str(place(shown[-1])) if len(rows) > limit and shown else None
    return Page(items=tuple(convert(row) for row in shown), next=following)


def latest_first(
    query: Select[Any], moment: InstrumentedAttribute[Any], identity: InstrumentedAttribute[str], cursor: str | None
) -> Select[Any]:
    """Returns a query in descending order of a time, and of the ID for equal times, from a cursor's place on."""
    if cursor is not None:
        place = Cursor.parse(cursor)
        # The first condition lets the database use an index; the second breaks ties of the time.
        query = query.where(moment <= place.moment, or_(moment < place.moment, identity < place.identity))
    return query.order_by(moment.desc(), identity.desc())


def newest_first(
    store: Store,
    query: Select[Any],
    number: InstrumentedAttribute[int],
    cursor: str | None,
    limit: int,
    convert: Callable[[Row], Item],
) -> Page[Item]:
    """Returns a page of a query's rows in descending order of `number`, which grows with every row even if clocks are
    set back."""
    query = query.order_by(number.desc())
    if cursor is not None:
        query = query.where(number < Cursor.parse(cursor).number)
    with store.reading() as session:
        rows = list(session.scalars(query.limit(limit + 1)))
    return page_of(rows, limit, convert, lambda row: Cursor(getattr(row, number.key)))
