"""What happened to the robot and its queue, and who asked for it."""

from __future__ import annotations

from pydantic import AwareDatetime

from daq.contracts.service.base import Wire


class ServiceEvent(Wire):
    """One thing that happened. `number` grows with every event, whatever the clock does."""

    number: int
    at: AwareDatetime
    kind: str
    """Such as `stop`, `reset`, `queue`, `experiment`, `connection`, or the kind of an event of the record."""
    text: str
    actor: str | None = None
    experiment: str | None = None
