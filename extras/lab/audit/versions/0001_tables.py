"""Creates the table of `tables.py`, and triggers that keep it append-only.

After a release this file is fixed, and each change is a migration of its own.
"""

from __future__ import annotations

from sqlalchemy import Connection

from extras.lab.audit.tables import AuditTable

REFUSED = "the audit log is append-only"
TRIGGERS = (
    f"CREATE TRIGGER audit_update BEFORE UPDATE ON audit BEGIN SELECT RAISE(ABORT, '{REFUSED}'); END",
    f"CREATE TRIGGER audit_delete BEFORE DELETE ON audit BEGIN SELECT RAISE(ABORT, '{REFUSED}'); END",
)


def upgrade(connection: Connection) -> None:
    """Creates the table."""
    AuditTable.metadata.create_all(connection, checkfirst=False)
    for statement in TRIGGERS:
        connection.exec_driver_sql(statement)
