"""The table, as `people.py` has it. After a release it is written out, and a change is a migration of its own."""

from __future__ import annotations

from sqlalchemy import Connection

from extras.lab.oidc.people import PeopleTable


def upgrade(connection: Connection) -> None:
    """Makes the table."""
    PeopleTable.metadata.create_all(connection, checkfirst=False)
