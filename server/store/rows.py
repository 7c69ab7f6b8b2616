"""Finds one row of a robot."""

from __future__ import annotations

from typing import TypeVar

from sqlalchemy import select
from sqlalchemy.orm import Session

from server.problems import not_found
from server.store.tables import Table

Row = TypeVar("Row", bound=Table)


def row_of(session: Session, table: type[Row], robot: str, identity: str, key: str = "id") -> Row:
    """Returns the row of a robot with this value of the column `key`. Raises a 404."""
    row = session.scalar(select(table).filter_by(**{"robot": robot, key: identity}))
    if row is None:
        name = table.__tablename__
        raise not_found(f"{name.removesuffix('s')} {identity!r}", f"GET …/{name} lists those there are")
    return row
