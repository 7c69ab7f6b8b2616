"""The catalogue's table: search, tags, notes, and which jobs and models use a trace."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from datetime import datetime

from sqlalchemy import Select, delete, func, or_, select, text, update
from sqlalchemy.orm import InstrumentedAttribute, Session

from daq.contracts.labels import Outcome, Source
from daq.contracts.service.base import Page
from daq.contracts.service.traces import CatalogueEntry, TraceChange
from server.problems import conflict, not_found
from server.store.engine import Store
from server.store.labels import label_of_row, trace_label, user_label
from server.store.pages import Cursor, page_of
from server.store.remembered import Remembered
from server.store.stretches import (
    EARLIEST,
    LATEST,
    PARTS,
    note_terms,
    ranges_of,
    read_within,
    stretch_of,
    stretches_with,
    terms_asked,
)
from server.store.tables import ArchivedRow, TraceRow, TraceTagRow, TraceUseRow

TRIGRAM = 3
"""Number of characters of the shortest text that an index of trigrams finds."""
FEW = 2000
"""Number of traces up to which a search fetches all that match, and sorts them."""
FULL_BY = 8
"""A search of a tag whose first part fills an eighth of the page reads on: the trigrams of a text that so many have
take longer."""
_FEW_OF_SQLITE = text(
    "SELECT trace FROM trace_numbers JOIN trace_words ON number = trace_words.rowid"
    " WHERE trace_words MATCH :phrase LIMIT :most"
)


@dataclass(frozen=True)
class NewTrace:
    """The columns of a new row."""

    id: str
    robot: str
    file: str
    created: datetime
    source: str
    kind: str | None
    name: str | None
    joints: tuple[int, ...]
    outcome: Outcome | None
    samples: int | None
    duration: float | None
    size: int
    operator: str | None
    experiment: str | None
    notes: str

    @property
    def label(self) -> str:
        """How messages name the trace."""
        return trace_label(self.name, self.kind, self.file, self.created)


@dataclass(frozen=True)
class TraceSearch:
    """The filters of a list; None and empty do not filter. `text` is searched in number, file, name, kind, operator,
    notes and tags, ignoring case."""

    text: str | None = None
    tag: str | None = None
    source: Source | None = None
    outcome: Outcome | None = None
    kind: str | None = None
    since: datetime | None = None
    until: datetime | None = None


class TraceStore:
    """Traces of all robots."""

    def __init__(self, store: Store) -> None:
        self._store = store
        self.page = Remembered(store, self._page, (TraceRow, TraceTagRow, ArchivedRow))

    def insert(self, new: NewTrace, is_there: Callable[[str], bool] = lambda _file: True) -> None:
        """Adds a trace. If its row exists and the row's file is gone, the row gets the new file, and keeps its tags and
        notes. Raises a 409 if the row has another file that `is_there`."""
        columns = {**new.__dict__, "joints": list(new.joints), "missing": False}
        with self._store.writing() as session:
            row = session.get(TraceRow, new.id)
            tags: tuple[str, ...] = ()
            if row is None:
                row = TraceRow(**columns, searched="")
            elif row.robot == new.robot and (row.file == new.file or not is_there(row.file)):
                tags = _tags(session, [row.id]).get(row.id, ())
                for name in columns.keys() - {"notes", "experiment"}:
                    setattr(row, name, columns[name])
                session.execute(update(TraceTagRow).filter_by(trace=row.id).values(created=row.created))
            else:
                line = f"{new.label} is in the catalogue already, as {row.file}"
                raise conflict("trace-exists", line, "it is the same trace: nothing needs to be done")
            session.add(row)
            _write_searched(session, row, tags)

    def files(self, robot: str) -> set[str]:
        """Returns the names of all files of a robot in the table."""
        with self._store.reading() as session:
            return set(session.scalars(select(TraceRow.file).filter_by(robot=robot)))

    def mark_missing(self, robot: str, files: Iterable[str], *, missing: bool) -> None:
        """Marks files of a robot as missing, or as existing again."""
        names = list(files)
        with self._store.writing() as session:
            for first in range(0, len(names), 500):
                part = names[first : first + 500]
                query = update(TraceRow).where(TraceRow.robot == robot, TraceRow.file.in_(part))
                query = query.where(TraceRow.missing.is_(not missing))
                session.execute(query.values(missing=missing))

    def file_of(self, robot: str, identity: str) -> str:
        """Returns the name of a trace's file. Raises a 404."""
        with self._store.reading() as session:
            return _row(session, robot, identity).file

    def files_of(self, robot: str, identities: Iterable[str]) -> dict[str, str]:
        """Returns the names of the files of traces, those that are in the table."""
        names, found = list(identities), dict[str, str]()
        with self._store.reading() as session:
            for first in range(0, len(names), 500):
                part = TraceRow.id.in_(names[first : first + 500])
                query = select(TraceRow.id, TraceRow.file).where(TraceRow.robot == robot, part)
                found.update((row.id, row.file) for row in session.execute(query))
        return found

    def get(self, robot: str, identity: str) -> CatalogueEntry:
        """Returns a trace's entry. Raises a 404."""
        with self._store.reading() as session:
            row = _row(session, robot, identity)
            archived = bool(_archived(session, [row.id]))
            return _entry(row, _tags(session, [row.id]).get(row.id, ()), archived=archived)

    def is_archived(self, identity: str) -> bool:
        """Whether the archive has a trace."""
        with self._store.reading() as session:
            return bool(_archived(session, [identity]))

    def archived_of(self, identities: Iterable[str]) -> set[str]:
        """Returns those of these traces that the archive has."""
        names, found = list(identities), set[str]()
        with self._store.reading() as session:
            for first in range(0, len(names), 500):
                found |= _archived(session, names[first : first + 500])
        return found

    def found(self, robot: str, search: TraceSearch, cursor: str | None, limit: int) -> Page[CatalogueEntry]:
        """Returns a part of the list, newest first, read anew."""
        return self._page(robot, search, cursor, limit)

    def _page(self, robot: str, search: TraceSearch, cursor: str | None, limit: int) -> Page[CatalogueEntry]:
        """Returns a part of the list, newest first."""
        place = None if cursor is None else Cursor.parse(cursor)
        if any("\0" in one for one in _texts(search)):  # which no database looks for
            return Page(items=())
        with self._store.reading() as session:
            rows = self._rows(session, robot, search, place, limit + 1)
            tags = _tags(session, [row.id for row in rows])
            archived = _archived(session, [row.id for row in rows])
        return page_of(
            rows,
            limit,
            lambda row: _entry(row, tags.get(row.id, ()), archived=row.id in archived),
            lambda row: Cursor(row.created.timestamp(), row.id),
        )

    def _rows(
        self, session: Session, robot: str, search: TraceSearch, place: Cursor | None, count: int
    ) -> list[TraceRow]:
        """Returns the first rows that a search finds after a place of the list, the newest first."""
        dialect = session.get_bind().dialect.name
        query, listed = _query(search, place, dialect), _listed(search, dialect)
        of_robot = query.where(TraceRow.robot == robot)
        terms = terms_asked(_texts(search))
        if not terms:
            return list(session.scalars(of_robot.limit(count)))
        until = min(search.until or LATEST, LATEST if place is None else place.moment)
        oldest, newest = stretch_of(search.since or EARLIEST), stretch_of(until)
        rows: list[TraceRow] = []
        of_tags = _reads_tags(search, dialect)
        parts = PARTS[1:] if of_tags else PARTS  # a tag leaves few rows of each stretch
        for at_once in parts:
            stretches = stretches_with(session, robot, terms, (oldest, newest), at_once)
            rows += read_within(session, of_robot, listed[0], ranges_of(stretches), count - len(rows))
            if len(rows) == count or at_once is None or len(stretches) < at_once:
                return rows
            newest = stretches[-1] - 1
            goes_on = at_once != parts[0] or (of_tags and len(rows) * FULL_BY >= count)
            few = None if goes_on else self._few_of(session, search)
            if few is not None:
                # Not `robot = …`: without statistics SQLite takes that for the narrower choice, and reads all of it.
                of_few = query.where(TraceRow.id.in_(few), func.coalesce(TraceRow.robot, "") == robot)
                return list(session.scalars(of_few.limit(count))) if few else []
        return rows

    def _few_of(self, session: Session, search: TraceSearch) -> list[str] | None:
        """Returns the identities of all traces with the text, or with the tag, of a search, if they are FEW at most."""
        if search.tag is not None and not _reads_tags(search, session.get_bind().dialect.name):
            tagged = select(TraceTagRow.trace).filter_by(tag=search.tag).limit(FEW + 1)
            found = list(session.scalars(tagged))
            if len(found) <= FEW:
                return found
        return self._few_with(session, search.text.lower()) if search.text else None

    def _few_with(self, session: Session, searched: str) -> list[str] | None:
        """Returns the identities of all traces with this text, which an index of trigrams finds. None if they are more
        than FEW, so that reading the list in its order soon finds the first ones, and if there is no such index."""
        if len(searched) < TRIGRAM:
            return None
        match session.get_bind().dialect.name:
            case "sqlite":
                phrase = '"' + searched.replace('"', '""') + '"'
                found = session.scalars(_FEW_OF_SQLITE, {"phrase": phrase, "most": FEW + 1})
            case "postgresql":
                matching = TraceRow.searched.contains(searched, autoescape=True)
                found = session.scalars(select(TraceRow.id).where(matching).limit(FEW + 1))
            case _:
                return None
        identities = list(found)
        return identities if len(identities) <= FEW else None

    def change(self, robot: str, identity: str, change: TraceChange) -> CatalogueEntry:
        """Changes tags or notes. Raises a 404."""
        with self._store.writing() as session:
            row = _row(session, robot, identity)
            if change.notes is not None:
                row.notes = change.notes
            if change.tags is not None:
                session.execute(delete(TraceTagRow).filter_by(trace=row.id))
                for tag in dict.fromkeys(change.tags):
                    session.add(TraceTagRow(trace=row.id, tag=tag, created=row.created))
            session.flush()
            tags = _tags(session, [row.id]).get(row.id, ())
            _write_searched(session, row, tags)
            return _entry(row, tags, archived=bool(_archived(session, [row.id])))

    def remove(self, robot: str, identity: str, also: Callable[[], None] = lambda: None) -> None:
        """Deletes the row. Raises a 404, and a 409 if a model or a job uses the trace.

        `also`, which deletes the file, is called last before the transaction is written: if it raises, the row stays.
        A row without a file can be deleted later; a file without a row would be added again without its tags.
        """
        with self._store.writing() as session:
            row = _row(session, robot, identity)
            users = list(session.scalars(select(TraceUseRow.used_by).filter_by(trace=identity).limit(5)))
            if users:
                line = f"{label_of_row(row)} is used by {', '.join(user_label(session, user) for user in users)}"
                raise conflict("trace-in-use", line, "delete those first")
            # The archive's service deletes the object, when the store can be reached.
            session.execute(update(ArchivedRow).filter_by(trace=identity).values(deleting=True))
            session.delete(row)
            session.flush()
            also()


def _row(session: Session, robot: str, identity: str) -> TraceRow:
    row = session.get(TraceRow, identity)
    if row is None or row.robot != robot:
        raise not_found(f"trace {identity!r}", "GET …/traces lists those there are")
    return row


def _tags(session: Session, identities: list[str]) -> dict[str, tuple[str, ...]]:
    found: dict[str, tuple[str, ...]] = {}
    query = select(TraceTagRow).where(TraceTagRow.trace.in_(identities)).order_by(TraceTagRow.tag)
    for row in session.scalars(query):
        found[row.trace] = (*found.get(row.trace, ()), row.tag)
    return found


def _archived(session: Session, identities: list[str]) -> set[str]:
    query = select(ArchivedRow.trace).where(ArchivedRow.trace.in_(identities), ArchivedRow.deleting.is_(False))
    return set(session.scalars(query))


Listed = tuple[InstrumentedAttribute[datetime], InstrumentedAttribute[str]]
"""The columns of the list's order: when a trace was recorded, and its number."""


def _reads_tags(search: TraceSearch, dialect: str) -> bool:
    """Whether a search reads the table of tags in the list's order, and of the traces those with the tag alone."""
    return search.tag is not None and dialect == "postgresql"


def _listed(search: TraceSearch, dialect: str) -> Listed:
    """Returns the columns by which a search reads the list."""
    if _reads_tags(search, dialect):
        return TraceTagRow.created, TraceTagRow.trace
    return TraceRow.created, TraceRow.id


def _query(search: TraceSearch, place: Cursor | None, dialect: str) -> Select[TraceRow]:
    """The traces of all robots that a search finds after a place of the list, the newest first."""
    query = select(TraceRow)
    created, identity = _listed(search, dialect)
    if _reads_tags(search, dialect):
        query = query.select_from(TraceTagRow).join(TraceRow, TraceRow.id == TraceTagRow.trace)
        query = query.where(TraceTagRow.tag == search.tag)
    for column, wanted in (("source", search.source), ("outcome", search.outcome), ("kind", search.kind)):
        if wanted is not None:
            query = query.where(getattr(TraceRow, column) == wanted)
    # The index of trigrams has another collation: else PostgreSQL may read it in place of a stretch of the list.
    searched = TraceRow.searched.collate("C") if dialect == "postgresql" else TraceRow.searched
    if search.text:
        query = query.where(searched.contains(search.text.lower(), autoescape=True))
    if search.tag is not None and not _reads_tags(search, dialect):
        # The text holds each tag in a line of its own, so the table of tags is asked of hardly any other trace.
        tagged = select(TraceTagRow.tag).where(TraceTagRow.trace == TraceRow.id, TraceTagRow.tag == search.tag)
        query = query.where(searched.contains(f"\n{search.tag.lower()}", autoescape=True), tagged.exists())
    if search.since is not None:
        query = query.where(created >= search.since)
    if search.until is not None:
        query = query.where(created < search.until)
    if place is not None:
        # No comparison of pairs: PostgreSQL would begin to read there, though a stretch begins much later.
        query = query.where(created <= place.moment)
        query = query.where(or_(created < place.moment, identity < place.identity))
    return query.order_by(created.desc(), identity.desc())


def _texts(search: TraceSearch) -> list[str]:
    """What a trace's text has if a search finds it: it holds what the filters compare, too, each in a line of its own
    below the number."""
    filters = (search.tag, search.source, search.outcome, search.kind)
    return [one.lower() for one in (search.text, *(f"\n{one}" for one in filters if one)) if one]


def _write_searched(session: Session, row: TraceRow, tags: Iterable[str]) -> None:
    """Writes the text that a search looks at, and notes for its stretch of the list what it has."""
    row.searched = _searched(row, tags)
    note_terms(session, row.robot, [(row.created, row.searched)])


def _searched(row: TraceRow, tags: Iterable[str]) -> str:
    parts = (row.id, row.file, row.name, row.kind, row.operator, row.notes, row.source, row.outcome, *tags)
    return "\n".join(part for part in parts if part).lower()


def _entry(row: TraceRow, tags: tuple[str, ...], *, archived: bool) -> CatalogueEntry:
    own = CatalogueEntry.model_fields.keys() - {"tags", "joints", "missing", "archived", "local"}
    return CatalogueEntry.model_validate(
        {name: getattr(row, name) for name in own}
        | {"tags": tags, "joints": tuple(row.joints)}
        | {"missing": row.missing and not archived, "archived": archived, "local": not row.missing}
    )
