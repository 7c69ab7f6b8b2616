"""Taught programs in the database. They are kept until they are deleted, and are visible to everybody."""

from __future__ import annotations

from datetime import datetime

from sqlalchemy import func, select
from sqlalchemy.orm import defer

from daq.contracts.frozen import like
from daq.contracts.service.base import Wire
from daq.contracts.service.teaching import ProgramEntry
from daq.teaching.program import Program
from server.problems import conflict
from server.store.engine import Store
from server.store.rows import row_of
from server.store.tables import ProgramRow

MOST_PROGRAMS = 1000
"""Most programs of one robot. They are listed on one page."""


class StoredProgram(Wire):
    """A program with its entry in the list."""

    entry: ProgramEntry
    program: Program


class ProgramStore:
    """Programs of all robots."""

    def __init__(self, store: Store, most: int = MOST_PROGRAMS) -> None:
        self._store = store
        self._most = most

    def all(self, robot: str) -> tuple[ProgramEntry, ...]:
        """Returns the programs of a robot, most recently changed first."""
        query = select(ProgramRow).options(defer(ProgramRow.program)).filter_by(robot=robot)
        query = query.order_by(ProgramRow.changed.desc(), ProgramRow.name)
        with self._store.reading() as session:
            return tuple(like(ProgramEntry, row) for row in session.scalars(query))

    def get(self, robot: str, name: str) -> StoredProgram:
        """Returns a program. Raises a 404."""
        with self._store.reading() as session:
            row = row_of(session, ProgramRow, robot, name, "name")
            return StoredProgram(entry=like(ProgramEntry, row), program=Program.model_validate(row.program))

    def put(
        self, robot: str, name: str, program: Program, revision: int | None, now: datetime, by: str
    ) -> ProgramEntry:
        """Saves a program under its own name; if that differs from `name`, the program `name` is renamed.

        `revision`: the revision that was edited, None for a new program. Raises a 409 if another client has changed the
        program meanwhile, if its new name is taken, or if there are too many programs; a 404 if the edited program is
        gone. Saving an identical program again changes nothing, so a client that lost the answer may repeat its
        request.
        """
        content = program.model_dump(mode="json")
        with self._store.writing() as session:
            there = session.get(ProgramRow, (robot, program.name))
            if there is not None and there.program == content:
                return like(ProgramEntry, there)
            if revision is None:
                if there is not None:
                    raise _taken(program.name)
                count = session.scalar(select(func.count()).select_from(ProgramRow).filter_by(robot=robot)) or 0
                if count >= self._most:
                    raise conflict("too-many-programs", f"there are {count} programs", "delete some of them first")
                row = ProgramRow(robot=robot, revision=0)
                session.add(row)
            else:
                row = row_of(session, ProgramRow, robot, name, "name")
                if program.name != name and there is not None:
                    raise _taken(program.name)
                if row.revision != revision:
                    line = f"program {name!r} was changed by {row.changed_by} meanwhile (revision {row.revision})"
                    raise conflict("program-changed", line, "load it again, or keep yours under another name")
            row.name, row.program, row.revision = program.name, content, row.revision + 1
            row.instructions = len(program.instructions)
            row.changed, row.changed_by = now, by
            session.flush()
            return like(ProgramEntry, row)

    def remove(self, robot: str, name: str) -> None:
        """Deletes a program permanently. Raises a 404."""
        with self._store.writing() as session:
            session.delete(row_of(session, ProgramRow, robot, name, "name"))


def _taken(name: str) -> Exception:
    return conflict("program-exists", f"there is a program {name!r} already", "choose another name, or delete that one")
