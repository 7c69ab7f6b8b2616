"""A filter is read in the order of the list: tags know when their trace was recorded, PostgreSQL indexes kinds and
outcomes."""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

revision = "0012"
down_revision = "0011"
branch_labels = None
depends_on = None

OF_POSTGRESQL = {"traces_by_kind": "kind", "traces_by_outcome": "outcome"}
"""SQLite has one index with all columns that a search reads, and would take one of these for the narrower one."""


def upgrade() -> None:
    """Upgrades the tables to this version."""
    op.add_column(
        "trace_tags", sa.Column("created", sa.DateTime(), nullable=False, server_default="1970-01-01 00:00:00")
    )
    op.execute("UPDATE trace_tags SET created = (SELECT created FROM traces WHERE traces.id = trace_tags.trace)")
    op.drop_index("ix_trace_tags_tag", "trace_tags")
    op.create_index("trace_tags_listed", "trace_tags", ["tag", "created", "trace"])
    if op.get_bind().dialect.name == "postgresql":
        for name, column in OF_POSTGRESQL.items():
            op.create_index(name, "traces", ["robot", column, "created", "id"])


def downgrade() -> None:
    """Undoes the upgrade."""
    if op.get_bind().dialect.name == "postgresql":
        for name in OF_POSTGRESQL:
            op.drop_index(name, "traces")
    op.drop_index("trace_tags_listed", "trace_tags")
    op.create_index("ix_trace_tags_tag", "trace_tags", ["tag"])
    with op.batch_alter_table("trace_tags", schema=None) as batch_op:
        batch_op.drop_column("created")
