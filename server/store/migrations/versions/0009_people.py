"""Experiments have owners (who submitted them, or made their schedule) and approvals; people have sessions. Roles of
tokens stay."""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

revision = "0009"
down_revision = "0008"
branch_labels = None
depends_on = None

OF_SCHEDULES = "SELECT created_by FROM schedules WHERE schedules.id = experiments.schedule"

REVIEWED = ("experiments", "schedules")


def upgrade() -> None:
    """Upgrades the tables to this version."""
    op.add_column("experiments", sa.Column("owner", sa.String(length=200), nullable=False, server_default=""))
    op.execute(f"UPDATE experiments SET owner = COALESCE(({OF_SCHEDULES}), submitted_by)")
    op.add_column("experiments", sa.Column("changed_by", sa.String(length=200), nullable=True))
    for table in REVIEWED:
        op.add_column(table, sa.Column("approved_content", sa.String(length=64), nullable=True))
        op.add_column(table, sa.Column("approved_by", sa.String(length=200), nullable=True))
        op.add_column(table, sa.Column("approved_as_owner", sa.Boolean(), nullable=True))
        op.add_column(table, sa.Column("approved", sa.DateTime(), nullable=True))
    op.create_table(
        "sessions",
        sa.Column("digest", sa.String(length=64), nullable=False),
        sa.Column("name", sa.String(length=64), nullable=False),
        sa.Column("role", sa.String(length=16), nullable=False),
        sa.Column("created", sa.DateTime(), nullable=False),
        sa.Column("expires", sa.DateTime(), nullable=False),
        sa.PrimaryKeyConstraint("digest"),
    )
    op.create_index(op.f("ix_sessions_name"), "sessions", ["name"])
    op.create_index(op.f("ix_sessions_expires"), "sessions", ["expires"])
    op.create_table(
        "people",
        sa.Column("name", sa.String(length=64), nullable=False),
        sa.Column("issuer", sa.String(length=500), nullable=False),
        sa.Column("subject", sa.String(length=255), nullable=False),
        sa.Column("since", sa.DateTime(), nullable=False),
        sa.PrimaryKeyConstraint("name"),
        sa.UniqueConstraint("issuer", "subject"),
    )


def downgrade() -> None:
    """Undoes the upgrade."""
    op.drop_table("people")
    op.drop_table("sessions")
    for table in REVIEWED:
        with op.batch_alter_table(table, schema=None) as batch_op:
            for column in ("approved", "approved_as_owner", "approved_by", "approved_content"):
                batch_op.drop_column(column)
    with op.batch_alter_table("experiments", schema=None) as batch_op:
        batch_op.drop_column("changed_by")
        batch_op.drop_column("owner")
