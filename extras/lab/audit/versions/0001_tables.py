"""Creates the table of `tables.py`, and triggers that keep it append-only.

After a release this file is fixed, and each change is a migration of its own.
"""

from __future__ import annotations

from sqlalchemy import Connection

from extras.lab.audit.tables import AuditTable

REFUSED = "the audit log is append-only"
NEXT = "new.sequence = COALESCE((SELECT MAX(sequence) FROM audit), 0) + 1"
FOLLOWS = f"new.previous = COALESCE((SELECT digest FROM audit ORDER BY sequence DESC LIMIT 1), '{'0' * 64}')"

# The trigger of inserts also forbids SQLite's INSERT OR REPLACE, which deletes a row without the trigger of deletes.
SQLITE = (
    f"CREATE TRIGGER audit_update BEFORE UPDATE ON audit BEGIN SELECT RAISE(ABORT, '{REFUSED}'); END",
    f"CREATE TRIGGER audit_delete BEFORE DELETE ON audit BEGIN SELECT RAISE(ABORT, '{REFUSED}'); END",
    f"""CREATE TRIGGER audit_insert BEFORE INSERT ON audit WHEN NOT ({NEXT} AND {FOLLOWS}) BEGIN
        SELECT RAISE(ABORT, '{REFUSED}');
    END""",
)
POSTGRESQL = (
    f"""CREATE FUNCTION refuse_audit_change() RETURNS trigger LANGUAGE plpgsql AS
        $$ BEGIN RAISE EXCEPTION '{REFUSED}'; END $$""",
    f"""CREATE FUNCTION require_audit_end() RETURNS trigger LANGUAGE plpgsql AS
        $$ BEGIN IF NOT ({NEXT} AND {FOLLOWS}) THEN RAISE EXCEPTION '{REFUSED}'; END IF; RETURN new; END $$""",
    """CREATE TRIGGER audit_update BEFORE UPDATE OR DELETE ON audit
        FOR EACH ROW EXECUTE FUNCTION refuse_audit_change()""",
    """CREATE TRIGGER audit_truncate BEFORE TRUNCATE ON audit
        FOR EACH STATEMENT EXECUTE FUNCTION refuse_audit_change()""",
    "CREATE TRIGGER audit_insert BEFORE INSERT ON audit FOR EACH ROW EXECUTE FUNCTION require_audit_end()",
)


def upgrade(connection: Connection) -> None:
    """Creates the table."""
    AuditTable.metadata.create_all(connection, checkfirst=False)
    for statement in SQLITE if connection.dialect.name == "sqlite" else POSTGRESQL:
        connection.exec_driver_sql(statement)
