"""Which experiment is next. Pure."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from datetime import datetime


@dataclass(frozen=True)
class Waiting:
    """One that waits. `sequence` is the order of submission, which no clock can change."""

    id: str
    sequence: int
    priority: int
    at: datetime | None


def next_due(waiting: Iterable[Waiting], now: datetime) -> Waiting | None:
    """The one to be run: the highest priority that is due, then the first submitted; None when none is due."""
    due = [one for one in waiting if one.at is None or one.at <= now]
    return min(due, key=lambda one: (-one.priority, one.sequence), default=None)
