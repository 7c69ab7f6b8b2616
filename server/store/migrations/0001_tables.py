"""Makes every table of `server/store/tables.py`.

No version has been released with this migration, so it follows the tables. After the first release it must be written
out, and each change of the tables becomes a separate migration.
"""

from __future__ import annotations

from sqlalchemy import Connection

from server.store.tables import Table


def upgrade(connection: Connection) -> None:
    """Makes the tables."""
    Table.metadata.create_all(connection, checkfirst=False)
