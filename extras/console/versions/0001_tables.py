"""Creates the table of `store.py`. After a release this file is fixed, and each change is a migration of its own."""

from __future__ import annotations

from sqlalchemy import Connection

from extras.console.store import MacroTable


def upgrade(connection: Connection) -> None:
    """Creates the table."""
    MacroTable.metadata.create_all(connection, checkfirst=False)
