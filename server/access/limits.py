"""Limits of a client: requests per second, and bytes per request."""

from __future__ import annotations

from dataclasses import dataclass, field

from starlette.exceptions import HTTPException
from starlette.types import Message, Receive

REQUESTS_A_SECOND = 300.0
"""Sustained request rate (1/s) of one caller at one address: three times the load with which the service was
measured."""
AT_ONCE = 600.0
"""Most requests that one caller at one address may send at once."""
LARGEST_BODY = 16 << 20
"""Largest body (bytes), enough for a recorded path of an hour."""
MOST_FIELDS, MOST_OF_A_PROGRAM = 20_000, 120_000
"""Most fields of a body. Each unknown field becomes an error, of 1 kB and 50 µs of the event loop. A sequence of 1000
moves has 12 000 fields, a program of 10 000 instructions for six joints 100 000."""
MOST_REMEMBERED = 10_000
"""Number of buckets above which full ones are deleted."""


@dataclass
class Bucket:
    """A token bucket: it holds up to `size` requests and refills with `rate` requests per second."""

    rate: float
    size: float
    level: float
    at: float

    def take(self, now: float) -> float:
        """Takes one request from the bucket. Returns 0, or the time (s) until the next one is available."""
        self.level = min(self.size, self.level + (now - self.at) * self.rate)
        self.at = now
        if self.level >= 1:
            self.level -= 1
            return 0.0
        return (1 - self.level) / self.rate


@dataclass
class Buckets:
    """One bucket for each caller and address."""

    rate: float = REQUESTS_A_SECOND
    size: float = AT_ONCE
    _buckets: dict[tuple[str, str], Bucket] = field(default_factory=dict)

    def take(self, who: str, address: str, now: float) -> float:
        """Takes one request from the bucket of a caller and address, as `Bucket.take` does."""
        key = (who, address)
        bucket = self._buckets.get(key)
        if bucket is None:
            if len(self._buckets) >= MOST_REMEMBERED:
                self._forget_full(now)
            bucket = self._buckets[key] = Bucket(self.rate, self.size, self.size, now)
        return bucket.take(now)

    def _forget_full(self, now: float) -> None:
        """Removes full buckets: a new one would be full too."""
        self._buckets = {k: b for k, b in self._buckets.items() if b.level + (now - b.at) * b.rate < b.size}


def counted(receive: Receive, largest: int, most: int = MOST_FIELDS) -> Receive:
    """Wraps `receive` so that it raises a 413 after more than `largest` bytes of body, or `most` fields."""
    size = fields = 0

    async def limited() -> Message:
        nonlocal size, fields
        message = await receive()
        if message["type"] == "http.request":
            body = message.get("body", b"")
            size += len(body)
            if size > largest:
                raise HTTPException(413, f"a body may have {largest >> 20} MB")
            fields += body.count(b":")  # each JSON field has one colon; in texts they are rare
            if fields > most:
                raise HTTPException(413, f"a body may have {most} fields")
        return message

    return limited
