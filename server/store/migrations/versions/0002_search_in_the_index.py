"""The index of traces has all that a search looks at."""

from __future__ import annotations

from alembic import op

revision = "0002"
down_revision = "0001"
branch_labels = None
depends_on = None


def upgrade() -> None:
    """Upgrades the tables to this version."""
    with op.batch_alter_table("traces", schema=None) as batch_op:
        batch_op.drop_index("traces_by_time")
        batch_op.create_index(
            "traces_found", ["robot", "created", "id", "source", "outcome", "kind", "searched"], unique=False
        )


def downgrade() -> None:
    """Undoes the upgrade."""
    with op.batch_alter_table("traces", schema=None) as batch_op:
        batch_op.drop_index("traces_found")
        batch_op.create_index("traces_by_time", ["robot", "created", "id"], unique=False)
