"""Traces that an archive has."""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

revision = "0007"
down_revision = "0006"
branch_labels = None
depends_on = None


def upgrade() -> None:
    """Upgrades the tables to this version."""
    op.create_table(
        "archived_traces",
        sa.Column("trace", sa.String(length=64), nullable=False),
        sa.Column("robot", sa.String(length=32), nullable=False),
        sa.Column("object", sa.String(length=400), nullable=False),
        sa.Column("size", sa.BigInteger(), nullable=False),
        sa.Column("sha256", sa.String(length=64), nullable=False),
        sa.Column("archived", sa.DateTime(), nullable=False),
        sa.Column("checked", sa.DateTime(), nullable=False),
        sa.Column("fetched", sa.DateTime(), nullable=True),
        sa.Column("deleting", sa.Boolean(), nullable=False),
        sa.PrimaryKeyConstraint("trace"),
    )
    op.create_index("archived_traces_by_robot", "archived_traces", ["robot", "deleting"])


def downgrade() -> None:
    """Undoes the upgrade. The objects stay in the archive."""
    op.drop_index("archived_traces_by_robot", "archived_traces")
    op.drop_table("archived_traces")
