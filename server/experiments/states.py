"""The states of an experiment, and what each event does to them. Pure.

queued → running → done | failed | cancelled | interrupted, and queued → cancelled. Nothing leaves an end: what was
interrupted never runs again by itself; who wants it again submits it again.
"""

from __future__ import annotations

from enum import StrEnum

from daq.contracts.service.experiments import ExperimentState


class Event(StrEnum):
    """What can happen to an experiment."""

    TAKEN = "taken"
    """The worker begins it."""
    COMPLETED = "completed"
    """The plan was carried out to its end."""
    REFUSED = "refused"
    """Something spoke against it; nothing moved."""
    FAULT = "fault"
    """A guard ended it."""
    STOPPED = "stopped"
    """Somebody stopped the arm, or cancelled the experiment while it ran."""
    CANCELLED = "cancelled"
    """Taken back before it began."""
    LOST = "lost"
    """The link, a process, or the power."""


class IllegalEventError(Exception):
    """An event that the state does not allow; nothing has changed."""

    def __init__(self, state: ExperimentState, event: Event) -> None:
        super().__init__(f"an experiment that is {state} cannot be {event}")
        self.state = state
        self.event = event


_TRANSITIONS: dict[tuple[ExperimentState, Event], ExperimentState] = {
    ("queued", Event.TAKEN): "running",
    ("queued", Event.CANCELLED): "cancelled",
    ("running", Event.COMPLETED): "done",
    ("running", Event.REFUSED): "failed",
    ("running", Event.FAULT): "failed",
    ("running", Event.STOPPED): "cancelled",
    ("running", Event.LOST): "interrupted",
}


def advance(state: ExperimentState, event: Event) -> ExperimentState:
    """The state after `event`. Raises IllegalEventError."""
    if (state, event) not in _TRANSITIONS:
        raise IllegalEventError(state, event)
    return _TRANSITIONS[state, event]


def after_restart(state: ExperimentState) -> ExperimentState:
    """What a state means when the service begins: what ran is interrupted, whatever became of it; all else stays."""
    return advance(state, Event.LOST) if state == "running" else state
