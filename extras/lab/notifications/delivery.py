"""A message on its way to one destination, and why it did not arrive."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import datetime
from typing import Protocol

from daq.contracts.errors import DaqError
from daq.contracts.exit_codes import NOT_REACHED


class DeliveryError(DaqError):
    """A message was not delivered. The text names the host and never repeats an answer's words.

    for_good:    whether it makes no sense to try again
    retry_after: time (s) for which the receiver asked to be left alone; None if it said nothing
    """

    exit_code = NOT_REACHED

    def __init__(self, line: str, *, for_good: bool = False, retry_after: float | None = None) -> None:
        super().__init__(line)
        self.for_good = for_good
        self.retry_after = retry_after


def problem_of(error: Exception) -> str:
    """Returns the line that tells why a message was not delivered. Of an error that nobody expected it has the kind
    alone, since its words may repeat a secret."""
    return (
        str(error) if isinstance(error, DeliveryError) else f"not sent: {type(error).__name__}, a fault of this program"
    )


@dataclass(frozen=True)
class Message:
    """A message in the outbox. `payload`: the text that is signed and posted, JSON; `id`: the same at each attempt, by
    which a receiver recognises a message that arrives twice."""

    id: str
    payload: str
    created: datetime


class Sender(Protocol):
    """Delivers messages to one destination."""

    def send(self, message: Message) -> str:
        """Delivers a message. Returns what was answered, in a few words of ours. Raises DeliveryError."""
        ...
