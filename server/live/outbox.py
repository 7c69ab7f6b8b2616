"""The messages that wait for one client, and the handling of slow clients. Pure: the caller passes the time.

If a client does not keep up, every second waiting sample is dropped, repeatedly if necessary. Many samples at once
after a pause of the service itself do not count. A client that has not taken anything for DROP_AFTER is dropped. Other
messages than samples are never left out.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, field

THIN_BEYOND = 50
"""Number of waiting samples (1 s of them) above which they are thinned, if the client has taken nothing for
THIN_AFTER."""
THIN_AFTER = 1.0
"""Time (s) since the client last took messages, after which its samples may be thinned."""
DROP_AFTER = 10.0
"""Time (s) since the client last took messages, after which it is dropped if any wait."""
MOST_WAITING = 4096
"""Number of waiting messages of any kind above which a client is dropped at once."""


@dataclass
class Outbox:
    """Encoded messages that wait, in order."""

    taken_at: float
    """When the client last took messages, or when the first waiting message was added."""
    left_out: int = 0
    """Number of samples dropped since the client was last informed."""
    _waiting: deque[tuple[bool, str]] = field(default_factory=deque)
    _samples: int = 0

    def __len__(self) -> int:
        return len(self._waiting)

    def put(self, message: str, now: float, *, sample: bool = False) -> None:
        """Adds a message. Samples are thinned if too many wait."""
        if not self._waiting:
            self.taken_at = now
        self._waiting.append((sample, message))
        if sample:
            self._samples += 1
            if self._samples > THIN_BEYOND and now - self.taken_at >= THIN_AFTER:
                self._thin()

    def take(self, now: float) -> list[str]:
        """Removes and returns all waiting messages in order, as taken by the client now."""
        messages = [message for _, message in self._waiting]
        self._waiting.clear()
        self._samples = 0
        self.taken_at = now
        return messages

    def is_hopeless(self, now: float) -> bool:
        """Whether the client must be dropped."""
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
