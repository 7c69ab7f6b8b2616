"""Every table as `server/store/tables.py` has it.

No version has been released with it, so it follows the tables. Once one has been, it is written out, and a change of
the tables is a migration of its own.
"""

from __future__ import annotations

from alembic import op

from server.store.tables import Table

revision = "0001"
down_revision = None
branch_labels = None
depends_on = None


def upgrade() -> None:
    """Makes the tables."""
    Table.metadata.create_all(op.get_bind(), checkfirst=False)
