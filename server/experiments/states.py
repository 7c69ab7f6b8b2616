"""The states of an experiment, and the transitions between them. Pure.

queued → running → done | failed | cancelled | interrupted, and queued → cancelled. An experiment never leaves an end
state: an interrupted one must be submitted again.

Also defined here: the order of the queue, and what the end of a run means for its experiment and for the queue.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from datetime import datetime
from enum import StrEnum

from daq.contracts import exit_codes
from daq.contracts.labels import Outcome
from daq.contracts.service.experiments import ExperimentState
from daq.owner.messages import Answer


@dataclass(frozen=True)
class Waiting:
    """A waiting experiment. `sequence`: order of submission, independent of clocks."""

    id: str
    sequence: int
    priority: int
    at: datetime | None


def next_due(waiting: Iterable[Waiting], now: datetime) -> Waiting | None:
    """The next experiment to run: of those due, the one with the highest priority, then the first submitted."""
    due = [one for one in waiting if one.at is None or one.at <= now]
    return min(due, key=lambda one: (-one.priority, one.sequence), default=None)


class Event(StrEnum):
    """Events of an experiment."""

    TAKEN = "taken"
    """The queue begins it."""
    COMPLETED = "completed"
    """The plan was carried out completely."""
    REFUSED = "refused"
    """A check failed before anything moved."""
    FAULT = "fault"
    """A safety check ended it."""
    STOPPED = "stopped"
    """A person stopped the arm, or cancelled the experiment while it ran."""
    CANCELLED = "cancelled"
    """A person cancelled it before it began."""
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
    """Returns the state after a restart of the service: a running experiment becomes interrupted; others stay
    unchanged."""
    return advance(state, Event.LOST) if state == "running" else state


_OF_OUTCOME: dict[Outcome, Event] = {
    "complete": Event.COMPLETED,
    "stopped": Event.STOPPED,
    "fault": Event.FAULT,
    "interrupted": Event.LOST,
}


@dataclass(frozen=True)
class Ending:
    """How an experiment ended. `left_out`: the answer whose trace could not be added to the catalogue at once."""

    event: Event
    reason: str
    outcome: Outcome | None = None
    left_out: Answer | None = None

    @property
    def word(self) -> str:
        """How a person says it: a run that left a part of its trace was not just cancelled."""
        return "stopped" if self.outcome == "stopped" else advance("running", self.event)

    @property
    def pauses_queue(self) -> bool:
        """Whether a person must look at the arm before the next experiment runs: always, except after a completed plan
        with its trace in the catalogue, or a plan refused before anything moved."""
        return self.left_out is not None or self.event not in (Event.COMPLETED, Event.REFUSED)


def ending_of(answer: Answer) -> Ending:
    """Returns the ending that the owner's answer reports."""
    if answer.finished is not None:
        return Ending(_OF_OUTCOME[answer.finished.outcome], answer.finished.reason, answer.finished.outcome)
    if answer.exit_code in (exit_codes.WRONG_INPUT, exit_codes.REFUSED):
        return Ending(Event.REFUSED, answer.problem)
    if answer.exit_code == exit_codes.NOT_REACHED:
        return Ending(Event.LOST, answer.problem)
    return Ending(Event.STOPPED if answer.exit_code == exit_codes.STOPPED else Event.FAULT, answer.problem)
