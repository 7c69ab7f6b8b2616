"""Macros in the database: kept until they are deleted, visible to everybody."""

from __future__ import annotations

from datetime import datetime
from typing import Any

from sqlalchemy import String, select
from sqlalchemy.orm import DeclarativeBase, Mapped, Session, mapped_column

from extras.console.messages import KeptMacro, Macro
from server.problems import conflict, not_found
from server.store.engine import Store
from server.store.tables import Table

MOST = 200
"""Most macros of one robot; they are listed on one page."""


class MacroTable(DeclarativeBase):
    """Base of the table."""

    type_annotation_map = Table.type_annotation_map


class MacroRow(MacroTable):
    """A macro of a robot."""

    __tablename__ = "macros_kept"

    robot: Mapped[str] = mapped_column(String(32), primary_key=True)
    name: Mapped[str] = mapped_column(String(64), primary_key=True)
    macro: Mapped[dict[str, Any]]
    revision: Mapped[int]
    changed: Mapped[datetime]
    changed_by: Mapped[str]


def all_macros(store: Store, robot: str) -> tuple[KeptMacro, ...]:
    """Returns a robot's macros, most recently changed first."""
    query = select(MacroRow).filter_by(robot=robot).order_by(MacroRow.changed.desc(), MacroRow.name)
    with store.reading() as session:
        return tuple(_kept(row) for row in session.scalars(query))


def get_macro(store: Store, robot: str, name: str) -> Macro:
    """Returns a macro. Raises a 404."""
    with store.reading() as session:
        return Macro.model_validate(_row(session, robot, name).macro)


def put_macro(store: Store, robot: str, macro: Macro, revision: int | None, now: datetime, by: str) -> KeptMacro:
    """Stores a macro: a new one, or a change to its `revision`. Raises a 409 if another client has changed it meanwhile
    or there are too many, and a 404 if the edited one is gone."""
    with store.writing() as session:
        row = session.get(MacroRow, (robot, macro.name))
        if revision is None:
            if row is not None:
                raise conflict("macro-exists", f"there is a macro {macro.name!r} already", "choose another name")
            if len(session.scalars(select(MacroRow.name).filter_by(robot=robot)).all()) >= MOST:
                raise conflict("too-many-macros", f"there are {MOST} macros", "delete some of them first")
            row = MacroRow(robot=robot, name=macro.name, revision=0)
            session.add(row)
        else:
            row = _row(session, robot, macro.name)
            if row.revision != revision:
                line = f"macro {macro.name!r} was changed by {row.changed_by} meanwhile"
                raise conflict("macro-changed", line, "load it again, or keep yours under another name")
        row.macro, row.revision = macro.model_dump(mode="json"), row.revision + 1
        row.changed, row.changed_by = now, by
        session.flush()
        return _kept(row)


def remove_macro(store: Store, robot: str, name: str) -> None:
    """Deletes a macro permanently. Raises a 404."""
    with store.writing() as session:
        session.delete(_row(session, robot, name))


def _kept(row: MacroRow) -> KeptMacro:
    macro = Macro.model_validate(row.macro)
    return KeptMacro(macro=macro, revision=row.revision, changed=row.changed, changed_by=row.changed_by)


def _row(session: Session, robot: str, name: str) -> MacroRow:
    row = session.get(MacroRow, (robot, name))
    if row is None:
        raise not_found(f"macro {name!r}", "GET …/macros lists those there are")
    return row
