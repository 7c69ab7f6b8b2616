"""What one client is still to be sent, and what happens when it reads too slowly. Pure: the caller says the time.

A client that does not keep up gets fewer samples first: those that wait are thinned to every second one, again and
again. Many at once, after a hiccup of the service itself, are no reason yet. One that has not taken anything for
DROP_AFTER is dropped. Messages that are no samples are never left out.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, field

THIN_BEYOND = 50
"""Samples that wait before they are thinned: one second's,"""
THIN_AFTER = 1.0
"""s without a frame taken, too."""
DROP_AFTER = 10.0
"""s without a frame taken, while something waits."""
MOST_WAITING = 4096
"""Messages of any kind: a client that far behind is dropped at once."""


@dataclass
class Outbox:
    """Encoded messages that wait, in order. `True` marks a sample."""

    taken_at: float
    left_out: int = 0
    """Samples left out since the client was last told."""
    _waiting: deque[tuple[bool, str]] = field(default_factory=deque)
    _samples: int = 0

    def __len__(self) -> int:
        return len(self._waiting)

    def put(self, message: str, now: float, *, sample: bool = False) -> None:
        """One more. Samples are thinned when too many wait."""
        if not self._waiting:
            self.taken_at = now
        self._waiting.append((sample, message))
        if sample:
            self._samples += 1
            if self._samples > THIN_BEYOND and now - self.taken_at >= THIN_AFTER:
                self._thin()

    def take(self, now: float) -> list[str]:
        """All that wait, in order; the client takes them now."""
        messages = [message for _, message in self._waiting]
        self._waiting.clear()
        self._samples = 0
        self.taken_at = now
        return messages

    def is_hopeless(self, now: float) -> bool:
        """Whether the client is to be dropped."""
        return bool(self._waiting) and (now - self.taken_at > DROP_AFTER or len(self._waiting) > MOST_WAITING)

    def _thin(self) -> None:
        kept: deque[tuple[bool, str]] = deque()
        number = 0
        for is_sample, message in self._waiting:
            if is_sample:
                number += 1
                if number % 2 == 0:
                    self.left_out += 1
                    continue
            kept.append((is_sample, message))
        self._waiting = kept
        self._samples = (number + 1) // 2
