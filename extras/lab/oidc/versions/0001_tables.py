"""Creates the table of `people.py`. After a release this file is fixed, and each change is a migration of its own."""

from __future__ import annotations

from sqlalchemy import Connection

from extras.lab.oidc.people import PeopleTable


def upgrade(connection: Connection) -> None:
    """Creates the table."""
    PeopleTable.metadata.create_all(connection, checkfirst=False)
