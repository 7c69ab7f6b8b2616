"""The order of the queue. Pure."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from datetime import datetime


@dataclass(frozen=True)
class Waiting:
    """A waiting experiment. `sequence` is the order of submission, which does not depend on a clock."""

    id: str
    sequence: int
    priority: int
    at: datetime | None


def next_due(waiting: Iterable[Waiting], now: datetime) -> Waiting | None:
    """The next experiment to run: of those due, the one with the highest priority, then the first submitted."""
    due = [one for one in waiting if one.at is None or one.at <= now]
    return min(due, key=lambda one: (-one.priority, one.sequence), default=None)
