"""The table of the layouts, as its migration makes it."""

from __future__ import annotations

from sqlalchemy import String, Text
from sqlalchemy.orm import DeclarativeBase, Mapped, mapped_column


class LayoutsTable(DeclarativeBase):
    """Base of the table."""


class LayoutsRow(LayoutsTable):
    """The layouts of one person, as the page writes them."""

    __tablename__ = "layouts"

    person: Mapped[str] = mapped_column(String(200), primary_key=True)
    text: Mapped[str] = mapped_column(Text)
