"""Schedules by a cron expression in a time zone, beside those of even intervals."""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

revision = "0013"
down_revision = "0012"
branch_labels = None
depends_on = None


def upgrade() -> None:
    """Upgrades the tables to this version."""
    with op.batch_alter_table("schedules", schema=None) as batch_op:
        batch_op.add_column(sa.Column("cron", sa.String(length=100), nullable=True))
        batch_op.add_column(sa.Column("zone", sa.String(length=64), nullable=True))


def downgrade() -> None:
    """Undoes the upgrade."""
    with op.batch_alter_table("schedules", schema=None) as batch_op:
        batch_op.drop_column("zone")
        batch_op.drop_column("cron")
