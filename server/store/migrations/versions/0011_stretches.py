"""A search finds short texts, and texts that only some years have, through what each stretch of the list has.

The rules of `server/store/stretches.py` are written out here, since those of a later version may differ.
"""

from __future__ import annotations

from collections import defaultdict
from datetime import datetime, timedelta
from itertools import pairwise

import sqlalchemy as sa
from alembic import op

revision = "0011"
down_revision = "0010"
branch_labels = None
depends_on = None

BEGINNING, STRETCH = datetime(1970, 1, 1), timedelta(days=2)
AT_A_TIME = 10_000
"""Number of rows that are read or written at a time."""
STRETCHES = sa.table(
    "trace_stretches", sa.column("robot", sa.String), sa.column("term", sa.String), sa.column("stretch", sa.Integer)
)
TRACES = sa.table(
    "traces", sa.column("robot", sa.String), sa.column("created", sa.DateTime), sa.column("searched", sa.Text)
)


def upgrade() -> None:
    """Upgrades the tables to this version."""
    op.create_table(
        "trace_stretches",
        sa.Column("robot", sa.String(length=32), nullable=False),
        sa.Column("term", sa.String(length=2), nullable=False),
        sa.Column("stretch", sa.Integer(), autoincrement=False, nullable=False),
        sa.PrimaryKeyConstraint("robot", "term", "stretch"),
        sqlite_with_rowid=False,
    )
    terms: defaultdict[tuple[str, int], set[str]] = defaultdict(set)
    connection = op.get_bind()
    for robot, created, searched in connection.execute(sa.select(TRACES)).yield_per(AT_A_TIME):
        pairs = map("".join, pairwise(searched))
        terms[robot, (created - BEGINNING) // STRETCH].update(searched, pairs)
    # In the order of the key, which makes the index small and quick to write.
    rows = sorted((robot, term, stretch) for (robot, stretch), having in terms.items() for term in having)
    for begun in range(0, len(rows), AT_A_TIME):
        part = [dict(zip(("robot", "term", "stretch"), row, strict=True)) for row in rows[begun : begun + AT_A_TIME]]
        connection.execute(sa.insert(STRETCHES), part)


def downgrade() -> None:
    """Undoes the upgrade."""
    op.drop_table("trace_stretches")
