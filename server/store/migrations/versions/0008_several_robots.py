"""A model belongs to each robot that it was uploaded to: its number is unique per robot, not in the database.

The other tables have named their robot from the first version on.
"""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

revision = "0008"
down_revision = "0007"
branch_labels = None
depends_on = None

COLUMNS = ("id", "robot", "name", "file", "created", "created_by", "parent", "job", "notes")


def upgrade() -> None:
    """Upgrades the tables to this version."""
    _make_anew(sa.PrimaryKeyConstraint("id", "robot"), sa.UniqueConstraint("robot", "file"), which="")


def downgrade() -> None:
    """Undoes the upgrade. Of a model that several robots have, the row of the first of them by name is left."""
    first = " WHERE robot = (SELECT MIN(other.robot) FROM models AS other WHERE other.id = models.id)"
    _make_anew(sa.PrimaryKeyConstraint("id"), sa.UniqueConstraint("file"), which=first)


def _make_anew(*constraints: sa.Constraint, which: str) -> None:
    """Copies the rows into a table with other constraints, which SQLite cannot change."""
    op.create_table(
        "models_anew",
        sa.Column("id", sa.String(length=64), nullable=False),
        sa.Column("robot", sa.String(length=32), nullable=False),
        sa.Column("name", sa.String(length=64), nullable=False),
        sa.Column("file", sa.String(length=255), nullable=False),
        sa.Column("created", sa.DateTime(), nullable=False),
        sa.Column("created_by", sa.String(length=200), nullable=False),
        sa.Column("parent", sa.String(length=64), nullable=True),
        sa.Column("job", sa.String(length=12), nullable=True),
        sa.Column("notes", sa.Text(), nullable=False),
        *constraints,
    )
    names = ", ".join(COLUMNS)
    op.execute(f"INSERT INTO models_anew ({names}) SELECT {names} FROM models{which}")
    op.drop_index(op.f("ix_models_robot"), "models")
    op.drop_table("models")
    op.rename_table("models_anew", "models")
    op.create_index(op.f("ix_models_robot"), "models", ["robot"])
