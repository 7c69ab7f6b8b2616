"""The table, as `tables.py` has it. After a release it is written out, and a change is a migration of its own."""

from __future__ import annotations

from alembic import op

from extras.lab.archive.tables import ArchiveTable

revision = "0001"
down_revision = None
branch_labels = None
depends_on = None


def upgrade() -> None:
    """Makes the table."""
    ArchiveTable.metadata.create_all(op.get_bind(), checkfirst=False)
