"""Which stretches of the list have which pairs of characters, so that a search reads only those that may have its text.

An index of trigrams says nothing about a text of one or two characters, and finds what many traces have without the
order of the list. So a table keeps, for every stretch of two days, each character and each pair of neighbouring
characters that the texts of its traces have had. A text can only be in stretches that have all its pairs: one that no
trace has is in none, and one that only old traces have is not looked for in the newer ones. A stretch keeps a pair
whose last trace is gone; that costs time, and finds nothing wrong.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from datetime import UTC, datetime, timedelta
from functools import lru_cache
from itertools import islice, pairwise

from sqlalchemy import (
    ARRAY,
    DateTime,
    Executable,
    Integer,
    Select,
    bindparam,
    column,
    func,
    insert,
    inspect,
    literal,
    select,
    true,
)
from sqlalchemy.orm import InstrumentedAttribute, Session

from server.store.tables import TraceRow, TraceStretchRow

STRETCH = timedelta(days=2)
"""Length of a stretch. At 200 traces a day it has 400, which took 0.6 ms to read on a busy computer; a million
traces are then 2700 stretches with 1.4 million rows of this table."""
BEGINNING = datetime(1970, 1, 1, tzinfo=UTC)
EARLIEST, LATEST = datetime.min.replace(tzinfo=UTC), datetime.max.replace(tzinfo=UTC)
MOST_TERMS = 8
"""Number of pairs by which a text is looked for: more of them leave hardly fewer stretches out."""
PARTS = (8, 64, 512, None)
"""Number of stretches that are looked for, and read, one part after the other; None for all that are left. A text that
many traces have is in the first ones."""
FIRST, MOST = 8, 64
"""Number of ranges that PostgreSQL is asked for at once at first, and at most: four times as many each time. What many
traces have is in one range, since its stretches are neighbours."""
AT_A_TIME = 500
"""Number of terms that one statement asks for: SQLite takes 32 766 values, and older ones 999."""
Range = tuple[datetime, datetime]
"""A time, and one that is later: from the first on, before the second."""


def stretch_of(moment: datetime) -> int:
    """Returns the number of the stretch that has this moment."""
    return (moment - BEGINNING) // STRETCH


def terms_of(searched: str) -> set[str]:
    """Returns all characters and pairs of neighbouring characters of a trace's text."""
    return {*searched, *("".join(pair) for pair in pairwise(searched))}


def terms_asked(texts: Iterable[str]) -> tuple[str, ...]:
    """Returns terms that a trace with all these texts has: MOST_TERMS at most, spread over them."""
    terms: dict[str, None] = {}
    for text in texts:
        terms.update(dict.fromkeys(map("".join, pairwise(text)) if len(text) > 1 else text))
    every = max(1, -(-len(terms) // MOST_TERMS))
    return tuple(terms)[::every]


def note_terms(session: Session, robot: str, texts: Iterable[tuple[datetime, str]]) -> None:
    """Notes what the texts of a robot's traces have, each with the time of its trace."""
    terms: dict[int, set[str]] = {}
    for created, searched in texts:
        terms.setdefault(stretch_of(created), set()).update(terms_of(searched))
    for stretch, having in terms.items():
        every = sorted(having)
        for begun in range(0, len(every), AT_A_TIME):
            _note(session, robot, stretch, every[begun : begun + AT_A_TIME])


def _note(session: Session, robot: str, stretch: int, terms: Sequence[str]) -> None:
    known = select(TraceStretchRow.term).filter_by(robot=robot, stretch=stretch)
    fresh = set(terms).difference(session.scalars(known.where(TraceStretchRow.term.in_(terms))))
    if fresh:
        session.execute(insert(TraceStretchRow), [{"robot": robot, "term": one, "stretch": stretch} for one in fresh])


def stretches_with(
    session: Session, robot: str, terms: Sequence[str], within: tuple[int, int], most: int | None = None
) -> list[int]:
    """Returns the stretches from one to another that have all these terms, the newest first: `most` of them at most."""
    values: dict[str, object] = {f"term{number}": term for number, term in enumerate(terms)}
    values.update(robot=robot, oldest=within[0], newest=within[1])
    if most is not None:
        values["most"] = most
    return list(session.scalars(_stretches(len(terms), limited=most is not None), values))


@lru_cache
def _stretches(count: int, *, limited: bool) -> Select[int]:
    """The query for so many terms. To put it together takes the client longer than PostgreSQL needs to answer it."""
    table = inspect(TraceStretchRow).local_table
    rows = [table.alias() for _ in range(count)]
    of_each = [
        (row.c.robot == bindparam("robot")) & (row.c.term == bindparam(f"term{n}")) for n, row in enumerate(rows)
    ]
    stretch = rows[0].c.stretch
    query = select(stretch).where(of_each[0], stretch.between(bindparam("oldest"), bindparam("newest")))
    for row, of_term in zip(rows[1:], of_each[1:], strict=True):
        query = query.where(select(row.c.stretch).where(of_term, row.c.stretch == stretch).exists())
    query = query.order_by(stretch.desc())
    return query.limit(bindparam("most", type_=Integer)) if limited else query


def ranges_of(stretches: Iterable[int]) -> Iterator[Range]:
    """Yields the times of stretches, the newest first; neighbouring stretches are one range."""
    newest = oldest = None
    for stretch in stretches:
        if newest is None or oldest is None:
            newest = stretch
        elif stretch != oldest - 1:
            yield _time_of(oldest), _time_of(newest + 1)
            newest = stretch
        oldest = stretch
    if newest is not None and oldest is not None:
        yield _time_of(oldest), _time_of(newest + 1)


def read_within(
    session: Session,
    query: Select[TraceRow],
    moment: InstrumentedAttribute[datetime],
    ranges: Iterable[Range],
    count: int,
) -> list[TraceRow]:
    """Returns the first `count` rows of a query whose column `moment` lies in ranges of time; rows and ranges have the
    list's order."""
    rows: list[TraceRow] = []
    together = session.get_bind().dialect.name == "postgresql"
    left, at_once = iter(ranges), FIRST if together else 1
    while len(rows) < count and (part := list(islice(left, at_once))):
        wanted = query.limit(count - len(rows))
        found = session.scalars(_each(wanted, moment, part) if len(part) > 1 else _one(wanted, moment, part[0]))
        rows += islice(found, count - len(rows))
        at_once = min(4 * at_once, MOST) if together else 1
    return rows


def _one(query: Select[TraceRow], moment: InstrumentedAttribute[datetime], within: Range) -> Select[TraceRow]:
    return query.where(moment >= within[0], moment < within[1])


def _each(query: Select[TraceRow], moment: InstrumentedAttribute[datetime], ranges: Sequence[Range]) -> Executable:
    """Asks PostgreSQL for several ranges at once, each through the list's index: an answer takes longer to come than
    to find. (`OR` leaves it to the planner, which may read the whole list.)"""
    begins, beyonds = (
        literal([time.replace(tzinfo=None) for time in ends], ARRAY(DateTime)) for ends in zip(*ranges, strict=True)
    )
    times = func.unnest(begins, beyonds).table_valued(column("begin"), column("beyond"), name="times").render_derived()
    found = query.where(moment >= times.c.begin, moment < times.c.beyond).lateral()
    joined = select(found).select_from(times).join(found, true())
    return select(TraceRow).from_statement(joined.order_by(found.c.created.desc(), found.c.id.desc()))


def _time_of(stretch: int) -> datetime:
    """When a stretch begins, within what a datetime can say."""
    try:
        return BEGINNING + stretch * STRETCH
    except OverflowError:
        return EARLIEST if stretch < 0 else LATEST
