"""Every table as `server/store/tables.py` has it.

No version has been released with it, so it follows the tables. Once one has been, it is written out, and a change of
the tables is a migration of its own.
"""

from __future__ import annotations

from sqlalchemy import Connection

from server.store.tables import Table


def upgrade(connection: Connection) -> None:
    """Makes the tables."""
    Table.metadata.create_all(connection, checkfirst=False)
