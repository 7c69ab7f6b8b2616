"""Why a job failed, for programs."""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

revision = "0005"
down_revision = "0004"
branch_labels = None
depends_on = None


def upgrade() -> None:
    """Upgrades the tables to this version. Older jobs have a reason only in words."""
    with op.batch_alter_table("jobs", schema=None) as batch_op:
        batch_op.add_column(sa.Column("failure", sa.String(length=32), nullable=True))
    op.execute("UPDATE jobs SET failure = 'program-fault' WHERE reason LIKE 'program fault: %'")
    op.execute("UPDATE jobs SET failure = 'refused' WHERE state = 'failed' AND failure IS NULL")
    op.execute("UPDATE jobs SET failure = 'lost' WHERE state = 'interrupted'")


def downgrade() -> None:
    """Undoes the upgrade."""
    with op.batch_alter_table("jobs", schema=None) as batch_op:
        batch_op.drop_column("failure")
