"""Creates the table of `tables.py`. After a release this file is fixed, and each change is a migration of its own."""

from __future__ import annotations

from sqlalchemy import Connection

from extras.lab.layouts.tables import LayoutsTable


def upgrade(connection: Connection) -> None:
    """Creates the table."""
    LayoutsTable.metadata.create_all(connection, checkfirst=False)
