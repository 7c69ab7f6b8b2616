"""Events of the robot and its queue, and who caused them."""

from __future__ import annotations

from pydantic import AwareDatetime

from daq.contracts.service.base import Wire


class ServiceEvent(Wire):
    """An event. `number` grows with every event, even if the clock is set back."""

    number: int
    at: AwareDatetime
    kind: str
    """Such as `stop`, `reset`, `queue`, `experiment`, `connection`, or the kind of an event in a record."""
    text: str
    actor: str | None = None
    experiment: str | None = None
