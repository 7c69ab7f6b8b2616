"""Models in the database, with the traces to which they were fitted."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Sequence

from sqlalchemy import select
from sqlalchemy.orm import Session

from daq.contracts.documents import shown
from daq.contracts.frozen import like
from daq.contracts.service.base import Page
from daq.contracts.service.jobs import ModelChange, ModelEntry
from server.problems import ProblemError, conflict
from server.store.engine import Store
from server.store.pages import Cursor, latest_first, page_of
from server.store.rows import row_of
from server.store.tables import ModelRow, TraceRow, TraceUseRow

MOST_ANCESTORS = 100
AT_ONCE = 500
"""Number of traces per query; SQLite allows 32 766 values in one."""


class ModelStore:
    """Models of all robots."""

    def __init__(self, store: Store) -> None:
        self._store = store

    def insert(
        self,
        new: ModelRow,
        traces: Iterable[str],
        also: Callable[[], None] = lambda: None,
        robots: Collection[str] | None = None,
    ) -> bool:
        """Adds a model; returns False if the robot has it already. Equal models have equal IDs.

        Args:
            traces: those to which the model was fitted.
            also: stores the file. Called last before the transaction is written: if it raises, there is no row.
            robots: the model's traces must belong to these; None for a model made by the service itself. Raises a 422
                otherwise.
        """
        with self._store.writing() as session:
            if session.get(ModelRow, (new.id, new.robot)) is not None:
                return False
            traces = tuple(dict.fromkeys(traces))
            if robots is not None:
                _require_traces(session, traces, robots)
            session.add(new)
            for trace in traces:
                session.merge(TraceUseRow(trace=trace, used_by=f"model {new.id}"))
            session.flush()
            also()
            return True

    def get(self, robot: str, identity: str) -> ModelEntry:
        """Returns a model's entry. Raises a 404."""
        with self._store.reading() as session:
            return _entry(session, row_of(session, ModelRow, robot, identity))

    def file_of(self, robot: str, identity: str) -> str:
        """Returns the name of a model's file. Raises a 404."""
        with self._store.reading() as session:
            return row_of(session, ModelRow, robot, identity).file

    def ancestors(self, robot: str, identity: str) -> tuple[ModelEntry, ...]:
        """Returns the ancestors of a model, the nearest first, as far as they are in the database."""
        found: list[ModelEntry] = []
        with self._store.reading() as session:
            row: ModelRow | None = row_of(session, ModelRow, robot, identity)
            while row is not None and row.parent is not None and len(found) < MOST_ANCESTORS:
                row = session.get(ModelRow, (row.parent, robot))
                if row is not None and row.id not in {one.id for one in found}:
                    found.append(_entry(session, row))
        return tuple(found)

    def newest(self, robot: str, most: int) -> tuple[ModelEntry, ...]:
        """Returns up to `most` models, newest first."""
        query = latest_first(select(ModelRow).filter_by(robot=robot), ModelRow.created, ModelRow.id, None)
        with self._store.reading() as session:
            return tuple(_entry(session, row) for row in session.scalars(query.limit(most)))

    def page(self, robot: str, cursor: str | None, limit: int) -> Page[ModelEntry]:
        """Returns a page of the list, newest first."""
        query = latest_first(select(ModelRow).where(ModelRow.robot == robot), ModelRow.created, ModelRow.id, cursor)
        with self._store.reading() as session:
            rows = list(session.scalars(query.limit(limit + 1)))
            return page_of(
                rows, limit, lambda row: _entry(session, row), lambda row: Cursor(row.created.timestamp(), row.id)
            )

    def change(self, robot: str, identity: str, change: ModelChange) -> ModelEntry:
        """Changes the name or the notes. Raises a 404."""
        with self._store.writing() as session:
            row = row_of(session, ModelRow, robot, identity)
            row.name = row.name if change.name is None else change.name
            row.notes = row.notes if change.notes is None else change.notes
            session.flush()
            return _entry(session, row)

    def remove(self, robot: str, identity: str, also: Callable[[str], None]) -> None:
        """Deletes a model. Raises a 404, and a 409 if another model was made from it.

        `also` deletes the file with the given name, last before the transaction is written. It is not called if another
        robot has the model too, and needs the file.
        """
        with self._store.writing() as session:
            row = row_of(session, ModelRow, robot, identity)
            child = session.scalar(select(ModelRow.name).filter_by(robot=robot, parent=identity))
            if child is not None:
                raise conflict("model-in-use", f"model {child!r} was made from {row.name!r}", "delete that one first")
            session.delete(row)
            if session.scalar(select(ModelRow.robot).where(ModelRow.id == identity, ModelRow.robot != robot)):
                return
            for use in session.scalars(select(TraceUseRow).filter_by(used_by=f"model {identity}")):
                session.delete(use)
            session.flush()
            also(row.file)


def _require_traces(session: Session, traces: Sequence[str], robots: Collection[str]) -> None:
    """Raises a 422 unless each trace belongs to one of these robots."""
    seen: set[str] = set()
    for part in range(0, len(traces), AT_ONCE):
        asked = traces[part : part + AT_ONCE]
        seen.update(session.scalars(select(TraceRow.id).where(TraceRow.id.in_(asked), TraceRow.robot.in_(robots))))
    if unseen := [trace for trace in traces if trace not in seen]:
        line = f"lineage.traces: {shown(unseen[0])} is no trace of this service"
        raise ProblemError(422, "not-a-model", line, "upload these traces first, or take them out of the lineage")


def _entry(session: Session, row: ModelRow) -> ModelEntry:
    traces = session.scalars(select(TraceUseRow.trace).filter_by(used_by=f"model {row.id}"))
    return like(ModelEntry, row, traces=tuple(sorted(traces)))
