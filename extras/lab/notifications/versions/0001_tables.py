"""The table, as `tables.py` has it. After a release it is written out, and a change is a migration of its own."""

from __future__ import annotations

from sqlalchemy import Connection

from extras.lab.notifications.tables import NotificationTable


def upgrade(connection: Connection) -> None:
    """Makes the table."""
    NotificationTable.metadata.create_all(connection, checkfirst=False)
