"""A search finds rare texts through an index of trigrams: SQLite's FTS5, or PostgreSQL's pg_trgm."""

from __future__ import annotations

import logging

from alembic import op
from sqlalchemy import Connection
from sqlalchemy.exc import DatabaseError

revision = "0006"
down_revision = "0005"
branch_labels = None
depends_on = None

LISTED = ["robot", "created", "id"]
SEARCHED = [*LISTED, "source", "outcome", "kind", "searched"]
log = logging.getLogger("server")

# The table `traces` has no number of its own that SQLite keeps when it packs the file, so `trace_numbers` gives one.
SQLITE = (
    "CREATE TABLE trace_numbers (number INTEGER NOT NULL PRIMARY KEY, trace VARCHAR(64) NOT NULL UNIQUE)",
    "INSERT INTO trace_numbers (trace) SELECT id FROM traces",
    "CREATE VIRTUAL TABLE trace_words USING fts5(searched, tokenize='trigram')",
    """INSERT INTO trace_words (rowid, searched)
        SELECT n.number, t.searched FROM trace_numbers n JOIN traces t ON t.id = n.trace""",
    """CREATE TRIGGER trace_words_insert AFTER INSERT ON traces BEGIN
        INSERT INTO trace_numbers (trace) VALUES (new.id);
        INSERT INTO trace_words (rowid, searched) SELECT number, new.searched FROM trace_numbers WHERE trace = new.id;
    END""",
    """CREATE TRIGGER trace_words_update AFTER UPDATE OF searched ON traces WHEN old.searched IS NOT new.searched BEGIN
        UPDATE trace_words SET searched = new.searched
        WHERE rowid = (SELECT number FROM trace_numbers WHERE trace = new.id);
    END""",
    """CREATE TRIGGER trace_words_delete AFTER DELETE ON traces BEGIN
        DELETE FROM trace_words WHERE rowid = (SELECT number FROM trace_numbers WHERE trace = old.id);
        DELETE FROM trace_numbers WHERE trace = old.id;
    END""",
)


def upgrade() -> None:
    """Upgrades the tables to this version."""
    connection = op.get_bind()
    if connection.dialect.name == "sqlite":
        for statement in SQLITE:
            op.execute(statement)
    elif connection.dialect.name == "postgresql":
        # PostgreSQL refuses an index entry of more than 2704 bytes, which a trace with long notes would need.
        op.drop_index("traces_found", "traces")
        op.create_index("traces_found", "traces", LISTED)
        if _has_trigrams(connection):
            op.create_index(
                "traces_words",
                "traces",
                ["searched"],
                postgresql_using="gin",
                postgresql_ops={"searched": "gin_trgm_ops"},
            )


def downgrade() -> None:
    """Undoes the upgrade."""
    connection = op.get_bind()
    if connection.dialect.name == "sqlite":
        for event in ("insert", "update", "delete"):
            op.execute(f"DROP TRIGGER trace_words_{event}")
        op.drop_table("trace_words")
        op.drop_table("trace_numbers")
    elif connection.dialect.name == "postgresql":
        op.drop_index("traces_words", "traces", if_exists=True)
        op.drop_index("traces_found", "traces")
        op.create_index("traces_found", "traces", SEARCHED)


def _has_trigrams(connection: Connection) -> bool:
    """Whether the database has the extension pg_trgm now: the owner of a database may add it, if it is installed."""
    try:
        with connection.begin_nested():
            op.execute("CREATE EXTENSION IF NOT EXISTS pg_trgm")
    except DatabaseError as error:
        line = " ".join(str(error.orig).split())
        log.warning("PostgreSQL's extension pg_trgm cannot be used (%s): searches read the whole table", line)
        return False
    return True
