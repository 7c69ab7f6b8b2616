"""The catalogue's table: search, tags, notes, and which jobs and models use a trace."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from datetime import datetime

from sqlalchemy import Select, delete, select, update
from sqlalchemy.orm import Session

from daq.contracts.frozen import like
from daq.contracts.labels import Outcome, Source
from daq.contracts.service.base import Page
from daq.contracts.service.traces import CatalogueEntry, TraceChange
from daq.traces.catalogue import TraceSummary
from server.problems import conflict
from server.store.engine import Store
from server.store.labels import label_of_row, trace_label, user_label
from server.store.pages import Cursor, latest_first, page_of
from server.store.rows import row_of
from server.store.tables import JobRow, TraceRow, TraceTagRow, TraceUseRow, spaced

_OF_SUMMARY = ("created", "kind", "name", "outcome", "samples", "duration", "size", "operator")
"""Columns that are fields of a summary."""


@dataclass(frozen=True)
class TraceSearch:
    """The filters of a list; None and empty do not filter. `text` is searched in ID, file, name, kind, operator, notes
    and tags, ignoring case. `joint` moved; `effect` was named by the newest diagnosis that used the trace."""

    text: str | None = None
    tag: str | None = None
    source: Source | None = None
    outcome: Outcome | None = None
    kind: str | None = None
    since: datetime | None = None
    until: datetime | None = None
    joint: int | None = None
    effect: str | None = None


class TraceStore:
    """Traces of all robots."""

    def __init__(self, store: Store) -> None:
        self._store = store

    def insert(
        self,
        robot: str,
        new: TraceSummary,
        experiment: str | None = None,
        file_exists: Callable[[str], bool] = lambda _file: True,
    ) -> None:
        """Adds a finished trace. If its row exists and the row's file is gone, the row gets the new file, and keeps its
        tags and notes. Raises a 409 if the row already refers to another existing file."""
        assert new.created is not None
        columns = {name: getattr(new, name) for name in _OF_SUMMARY} | {
            "file": new.path.name,
            "source": new.source or "imported",
            "joints": list(new.joints),
            "moved": spaced(new.moved or ()),
            "missing": False,
        }
        with self._store.writing() as session:
            row = session.get(TraceRow, new.trace_id)
            tags: tuple[str, ...] = ()
            if row is None:
                own = {"id": new.trace_id, "robot": robot, "experiment": experiment, "notes": new.notes}
                row = TraceRow(**own, **columns, searched="")
            elif row.robot == robot and (row.file == new.path.name or not file_exists(row.file)):
                tags = _tags(session, [row.id]).get(row.id, ())
                for name, value in columns.items():
                    setattr(row, name, value)
            else:
                label = trace_label(new.name, new.kind, new.path.name, new.created)
                line = f"{label} is in the catalogue already, as {row.file}"
                raise conflict("trace-exists", line, "it is the same trace: nothing needs to be done")
            session.add(row)
            row.searched = _searched(row, tags)

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
            return row_of(session, TraceRow, robot, identity).file

    def get(self, robot: str, identity: str) -> CatalogueEntry:
        """Returns a trace's entry. Raises a 404."""
        with self._store.reading() as session:
            row = row_of(session, TraceRow, robot, identity)
            return _entry(row, _tags(session, [row.id]).get(row.id, ()))

    def page(self, robot: str, search: TraceSearch, cursor: str | None, limit: int) -> Page[CatalogueEntry]:
        """Returns a page of the list, newest first."""
        # SQLite ends a pattern at NUL, and would find everything; nothing can match.
        if any("\0" in one for one in (search.text, search.tag, search.kind) if one):
            return Page(items=())
        with self._store.reading() as session:
            rows = list(session.scalars(_query(robot, search, cursor).limit(limit + 1)))
            tags = _tags(session, [row.id for row in rows])
        return page_of(
            rows,
            limit,
            lambda row: _entry(row, tags.get(row.id, ())),
            lambda row: Cursor(row.created.timestamp(), row.id),
        )

    def change(self, robot: str, identity: str, change: TraceChange) -> CatalogueEntry:
        """Changes tags or notes. Raises a 404."""
        with self._store.writing() as session:
            row = row_of(session, TraceRow, robot, identity)
            if change.notes is not None:
                row.notes = change.notes
            if change.tags is not None:
                session.execute(delete(TraceTagRow).filter_by(trace=row.id))
                for tag in dict.fromkeys(change.tags):
                    session.add(TraceTagRow(trace=row.id, tag=tag))
            session.flush()
            tags = _tags(session, [row.id]).get(row.id, ())
            row.searched = _searched(row, tags)
            return _entry(row, tags)

    def remove(self, robot: str, identity: str, also: Callable[[], None] = lambda: None) -> None:
        """Deletes the row. Raises a 404, and a 409 if a model or a job uses the trace.

        `also` deletes the file. It is called last before the transaction is written: if it raises, the row stays. A row
        without a file can be deleted later; a file without a row would be added again without its tags.
        """
        with self._store.writing() as session:
            row = row_of(session, TraceRow, robot, identity)
            users = list(session.scalars(select(TraceUseRow.used_by).filter_by(trace=identity).limit(5)))
            if users:
                line = f"{label_of_row(row)} is used by {', '.join(user_label(session, user) for user in users)}"
                raise conflict("trace-in-use", line, "delete those first")
            session.delete(row)
            session.flush()
            also()


def _tags(session: Session, identities: list[str]) -> dict[str, tuple[str, ...]]:
    found: dict[str, tuple[str, ...]] = {}
    query = select(TraceTagRow).where(TraceTagRow.trace.in_(identities)).order_by(TraceTagRow.tag)
    for row in session.scalars(query):
        found[row.trace] = (*found.get(row.trace, ()), row.tag)
    return found


def _query(robot: str, search: TraceSearch, cursor: str | None) -> Select[TraceRow]:
    """The traces of a robot that match a search, after a place in the list, newest first.

    The query stops once a page is full. A text that matches nothing scans all rows.
    """
    query = select(TraceRow).where(TraceRow.robot == robot)
    for column, wanted in (
        (TraceRow.source, search.source),
        (TraceRow.outcome, search.outcome),
        (TraceRow.kind, search.kind),
    ):
        if wanted is not None:
            query = query.where(column == wanted)
    if search.text:
        query = query.where(TraceRow.searched.contains(search.text.lower(), autoescape=True))
    if search.tag is not None:
        tagged = select(TraceTagRow.tag).where(TraceTagRow.trace == TraceRow.id, TraceTagRow.tag == search.tag)
        query = query.where(tagged.exists())
    if search.joint is not None:
        query = query.where(TraceRow.moved.contains(f" {search.joint} "))
    if search.effect is not None:
        done = select(JobRow.effects).join(TraceUseRow, TraceUseRow.used_by == "job " + JobRow.id)
        done = done.where(TraceUseRow.trace == TraceRow.id, JobRow.kind == "diagnose", JobRow.state == "done")
        newest = done.order_by(JobRow.sequence.desc()).limit(1).scalar_subquery()
        query = query.where(newest.contains(f" {search.effect} ", autoescape=True))
    if search.since is not None:
        query = query.where(TraceRow.created >= search.since)
    if search.until is not None:
        query = query.where(TraceRow.created < search.until)
    return latest_first(query, TraceRow.created, TraceRow.id, cursor)


def _searched(row: TraceRow, tags: Iterable[str]) -> str:
    parts = (row.id, row.file, row.name, row.kind, row.operator, row.notes, row.source, row.outcome, *tags)
    return "\n".join(part for part in parts if part).lower()


def _entry(row: TraceRow, tags: tuple[str, ...]) -> CatalogueEntry:
    return like(CatalogueEntry, row, tags=tags, moved=tuple(map(int, row.moved.split())))
