"""The table of notifications, as its migration makes it."""

from __future__ import annotations

from datetime import datetime

from sqlalchemy import Index, String, Text
from sqlalchemy.orm import DeclarativeBase, Mapped, mapped_column

from server.store.tables import Table


class NotificationTable(DeclarativeBase):
    """Base of the table."""

    type_annotation_map = Table.type_annotation_map


class OutboxRow(NotificationTable):
    """A notification for one destination."""

    __tablename__ = "notifications"
    __table_args__ = (Index("notifications_by_destination", "destination", "state", "next_attempt"),)

    sequence: Mapped[int] = mapped_column(primary_key=True, autoincrement=True)
    id: Mapped[str] = mapped_column(String(40))
    """ID of the message, which is the same for all its destinations."""
    destination: Mapped[str] = mapped_column(String(48))
    payload: Mapped[str] = mapped_column(Text)
    created: Mapped[datetime]
    attempts: Mapped[int] = mapped_column(default=0)
    next_attempt: Mapped[datetime]
    state: Mapped[str] = mapped_column(String(16))
    """`waiting`, `sent` or `given-up`."""
    problem: Mapped[str] = mapped_column(Text, default="")
    ended: Mapped[datetime | None]
