"""The states of an experiment, and the transitions between them. Pure.

queued → running → done | failed | cancelled | interrupted, and queued → cancelled. An experiment never leaves an end
state: an interrupted one does not run again by itself, but must be submitted again.
"""

from __future__ import annotations

from enum import StrEnum

from daq.contracts.service.experiments import ExperimentState


class Event(StrEnum):
    """What can happen to an experiment."""

    TAKEN = "taken"
    """The worker begins it."""
    COMPLETED = "completed"
    """The plan was carried out completely."""
    REFUSED = "refused"
    """A check failed before anything moved."""
    FAULT = "fault"
    """A safety check ended it."""
    STOPPED = "stopped"
    """Somebody stopped the arm, or cancelled the experiment while it ran."""
    CANCELLED = "cancelled"
    """Somebody cancelled it before it began."""
    LOST = "lost"
    """The link, a process or the power failed."""


class IllegalEventError(Exception):
    """The state does not allow this event; nothing has changed."""

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
    """Returns the state after `event`. Raises IllegalEventError."""
    if (state, event) not in _TRANSITIONS:
        raise IllegalEventError(state, event)
    return _TRANSITIONS[state, event]


def after_restart(state: ExperimentState) -> ExperimentState:
    """Returns the state after a restart of the service: a running experiment is interrupted; other states stay."""
    return advance(state, Event.LOST) if state == "running" else state
