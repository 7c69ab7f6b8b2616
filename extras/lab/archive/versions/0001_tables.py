"""Creates the table of `tables.py`. After a release this file is fixed, and each change is a migration of its own."""

from __future__ import annotations

from sqlalchemy import Connection

from extras.lab.archive.tables import ArchiveTable


def upgrade(connection: Connection) -> None:
    """Creates the table."""
    ArchiveTable.metadata.create_all(connection, checkfirst=False)
