"""The table of the archive, as its migration makes it."""

from __future__ import annotations

from datetime import datetime

from sqlalchemy import BigInteger, Index, String
from sqlalchemy.orm import DeclarativeBase, Mapped, mapped_column

from server.store.tables import Table


class ArchiveTable(DeclarativeBase):
    """Base of the table."""

    type_annotation_map = Table.type_annotation_map


class ArchivedRow(ArchiveTable):
    """A trace that the archive has, verified by reading it back. The row stays until the object is deleted, also if the
    trace is deleted before that."""

    __tablename__ = "archived_traces"
    __table_args__ = (Index("archived_traces_by_robot", "robot", "deleting"),)

    trace: Mapped[str] = mapped_column(String(64), primary_key=True)
    robot: Mapped[str] = mapped_column(String(32))
    object: Mapped[str] = mapped_column(String(400))
    """The object's name in the bucket."""
    size: Mapped[int] = mapped_column(BigInteger)
    sha256: Mapped[str] = mapped_column(String(64))
    archived: Mapped[datetime]
    checked: Mapped[datetime]
    """When the object was last read back and was equal to the file that had been sent."""
    fetched: Mapped[datetime | None]
    deleting: Mapped[bool] = mapped_column(default=False)
