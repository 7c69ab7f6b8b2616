"""A message for one destination, and the errors of its delivery."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import datetime
from typing import Protocol

from daq.contracts.errors import DaqError
from daq.contracts.exit_codes import NOT_REACHED


class DeliveryError(DaqError):
    """A message was not delivered. The text names the host and never repeats an answer's words.

    for_good:    whether another attempt is pointless
    retry_after: time (s) for which the receiver asked for no message; None if it did not
    """

    exit_code = NOT_REACHED

    def __init__(self, line: str, *, for_good: bool = False, retry_after: float | None = None) -> None:
        super().__init__(line)
        self.for_good = for_good
        self.retry_after = retry_after


def problem_of(error: Exception) -> str:
    """Returns one line on why a message was not delivered.

    For an unexpected error it states only the type, since its text may contain a secret.
    """
    return (
        str(error) if isinstance(error, DeliveryError) else f"not sent: {type(error).__name__}, a fault of this program"
    )


@dataclass(frozen=True)
class Message:
    """A message in the outbox. `payload`: the signed and posted text, JSON; `id`: the same at each attempt, so that a
    receiver recognises repeated messages."""

    id: str
    payload: str
    created: datetime


class Sender(Protocol):
    """Delivers messages to one destination."""

    def send(self, message: Message) -> str:
        """Delivers a message. Returns the answer, in a few words of this program. Raises DeliveryError."""
        ...
