"""Finds one row of a robot, and converts rows to records for clients."""

from __future__ import annotations

from typing import Any, TypeVar

from pydantic import BaseModel
from sqlalchemy import select
from sqlalchemy.orm import Session

from server.problems import not_found
from server.store.tables import Table

Row = TypeVar("Row", bound=Table)
Record = TypeVar("Record", bound=BaseModel)


def row_of(session: Session, table: type[Row], robot: str, identity: str, key: str = "id") -> Row:
    """Returns the row of a robot with this value of the column `key`. Raises a 404."""
    row = session.scalar(select(table).filter_by(**{"robot": robot, key: identity}))
    if row is None:
        name = table.__tablename__
        raise not_found(f"{name.removesuffix('s')} {identity!r}", f"GET …/{name} lists those there are")
    return row


def as_record(kind: type[Record], row: Table, **others: Any) -> Record:
    """Returns a record with the row's columns of the same names. `others`: its fields that differ from the row."""
    own = {name: getattr(row, name) for name in kind.model_fields if name not in others and hasattr(row, name)}
    return kind.model_validate(own | others)
