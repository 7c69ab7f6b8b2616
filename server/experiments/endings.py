"""The meaning of a run's end for its experiment and for the queue. Pure."""

from __future__ import annotations

from dataclasses import dataclass

from daq.contracts import exit_codes
from daq.contracts.labels import Outcome
from daq.owner.messages import Answer
from server.experiments.states import Event

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
    def pauses_queue(self) -> bool:
        """Whether a person must look at the arm before the next experiment runs: always, except after a completed plan
        whose trace is in the catalogue, or after a plan refused before anything moved."""
        return self.left_out is not None or self.event not in (Event.COMPLETED, Event.REFUSED)


def ending_of(answer: Answer) -> Ending:
    """Returns the ending that the answer of the port's owner reports."""
    if answer.finished is not None:
        return Ending(_OF_OUTCOME[answer.finished.outcome], answer.finished.reason, answer.finished.outcome)
    if answer.exit_code in (exit_codes.WRONG_INPUT, exit_codes.REFUSED):
        return Ending(Event.REFUSED, answer.problem)
    if answer.exit_code == exit_codes.NOT_REACHED:
        return Ending(Event.LOST, answer.problem)
    return Ending(Event.STOPPED if answer.exit_code == exit_codes.STOPPED else Event.FAULT, answer.problem)
