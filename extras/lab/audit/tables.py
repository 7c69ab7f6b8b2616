"""The table of the audit log, as its migration makes it."""

from __future__ import annotations

from datetime import datetime

from sqlalchemy import Index, String, Text
from sqlalchemy.orm import DeclarativeBase, Mapped, mapped_column

from server.store.tables import Table


class AuditTable(DeclarativeBase):
    """Base of the table."""

    type_annotation_map = Table.type_annotation_map


class AuditRow(AuditTable):
    """One row of the audit log. Triggers forbid changing or deleting it."""

    __tablename__ = "audit"
    __table_args__ = (
        Index("audit_by_actor", "actor", "sequence"),
        Index("audit_by_robot", "robot", "sequence"),
    )

    sequence: Mapped[int] = mapped_column(primary_key=True)
    at: Mapped[datetime]
    actor: Mapped[str | None]
    role: Mapped[str | None] = mapped_column(String(16))
    origin: Mapped[str]
    action: Mapped[str] = mapped_column(String(64))
    request: Mapped[str] = mapped_column(Text)
    robot: Mapped[str | None] = mapped_column(String(64))
    subject: Mapped[str | None]
    outcome: Mapped[str] = mapped_column(String(16))
    status: Mapped[int | None]
    detail: Mapped[str] = mapped_column(Text)
    content: Mapped[str | None] = mapped_column(Text)
    request_id: Mapped[str | None] = mapped_column(String(16))
    count: Mapped[int]
