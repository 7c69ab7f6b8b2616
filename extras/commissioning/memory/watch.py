"""Reports which bytes of the memory change, how fast, and together with which others."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from extras.commissioning.memory.recording import PageReading

TOGETHER = 0.8
"""Least share of common changes of two bytes that count as changing together."""
LEAST_CHANGES = 4
"""Least number of changes for that judgement."""


@dataclass(frozen=True)
class WatchedByte:
    """One byte of the memory over a series of readings.

    rate:     changes per second
    together: addresses of other bytes that change at the same times
    """

    address: int
    value: int
    lowest: int
    highest: int
    changes: int
    rate: float
    together: tuple[int, ...]

    def as_data(self) -> dict[str, Any]:
        """Returns plain data for JSON; addresses in hexadecimal."""
        return {
            "address": f"{self.address:04X}",
            "value": self.value,
            "lowest": self.lowest,
            "highest": self.highest,
            "changes": self.changes,
            "rate": round(self.rate, 2),
            "together": [f"{address:04X}" for address in self.together],
        }


def watched(base: int, readings: Sequence[PageReading]) -> list[WatchedByte]:
    """Returns every byte, in order, from consecutive readings."""
    pages = np.frombuffer(b"".join(r.data for r in readings), np.uint8).reshape(len(readings), -1)
    changed = np.diff(pages.astype(np.int16), axis=0) != 0
    counts = changed.sum(axis=0)
    seconds = readings[-1].time_s - readings[0].time_s
    both = changed.T.astype(np.int64) @ changed.astype(np.int64)
    either = counts[:, None] + counts[None, :] - both
    alike = (both >= TOGETHER * np.maximum(either, 1)) & (counts >= LEAST_CHANGES)
    np.fill_diagonal(alike, False)
    return [
        WatchedByte(
            base + offset,
            int(pages[-1, offset]),
            int(pages[:, offset].min()),
            int(pages[:, offset].max()),
            int(counts[offset]),
            float(counts[offset] / seconds) if seconds > 0 else 0.0,
            tuple(base + int(other) for other in np.flatnonzero(alike[offset])),
        )
        for offset in range(pages.shape[1])
    ]
