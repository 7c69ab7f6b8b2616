"""What a job found, in one line."""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

revision = "0003"
down_revision = "0002"
branch_labels = None
depends_on = None


def upgrade() -> None:
    """Upgrades the tables to this version."""
    with op.batch_alter_table("jobs", schema=None) as batch_op:
        batch_op.add_column(sa.Column("headline", sa.Text(), nullable=False, server_default=""))


def downgrade() -> None:
    """Undoes the upgrade."""
    with op.batch_alter_table("jobs", schema=None) as batch_op:
        batch_op.drop_column("headline")
