"""Taught programs."""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

revision = "0004"
down_revision = "0003"
branch_labels = None
depends_on = None


def upgrade() -> None:
    """Upgrades the tables to this version."""
    op.create_table(
        "programs",
        sa.Column("robot", sa.String(length=32), nullable=False),
        sa.Column("name", sa.String(length=64), nullable=False),
        sa.Column("program", sa.JSON(), nullable=False),
        sa.Column("instructions", sa.Integer(), nullable=False),
        sa.Column("revision", sa.Integer(), nullable=False),
        sa.Column("changed", sa.DateTime(), nullable=False),
        sa.Column("changed_by", sa.String(length=200), nullable=False),
        sa.PrimaryKeyConstraint("robot", "name"),
    )


def downgrade() -> None:
    """Undoes the upgrade."""
    op.drop_table("programs")
