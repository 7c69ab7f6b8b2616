"""Every experiment has an owner: who submitted it, or who made the schedule that did. Roles of tokens stay as they are."""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

revision = "0009"
down_revision = "0008"
branch_labels = None
depends_on = None

OF_SCHEDULES = "SELECT created_by FROM schedules WHERE schedules.id = experiments.schedule"


def upgrade() -> None:
    """Upgrades the tables to this version."""
    op.add_column("experiments", sa.Column("owner", sa.String(length=200), nullable=False, server_default=""))
    op.execute(f"UPDATE experiments SET owner = COALESCE(({OF_SCHEDULES}), submitted_by)")


def downgrade() -> None:
    """Undoes the upgrade."""
    with op.batch_alter_table("experiments", schema=None) as batch_op:
        batch_op.drop_column("owner")
