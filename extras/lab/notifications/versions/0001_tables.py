"""Creates the table of `tables.py`. After a release this file is fixed, and each change is a migration of its own."""

from __future__ import annotations

from sqlalchemy import Connection

from extras.lab.notifications.tables import NotificationTable


def upgrade(connection: Connection) -> None:
    """Creates the table."""
    NotificationTable.metadata.create_all(connection, checkfirst=False)
