"""One control period as the controller saw it, and a ring buffer of the last ones."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass

RING_DEPTH = 64
"""Number of snapshots kept: 1.28 s at the default period."""


@dataclass(frozen=True, slots=True)
class PeriodSnapshot:
    """Set points taken (posture units), positions and errors (ADC counts), powers (DAC counts) of joints 1 to 6.

    `time_us` is the board's time at which the period began and the positions were sampled.
    """

    tick: int
    time_us: int
    set_points: tuple[int, ...]
    positions: tuple[int, ...]
    errors: tuple[int, ...]
    powers: tuple[int, ...]
    set_point_missed: bool
    frozen: bool


class SnapshotRing:
    """The newest snapshots, oldest first, with consecutive ticks."""

    def __init__(self, depth: int = RING_DEPTH) -> None:
        self._snapshots: deque[PeriodSnapshot] = deque(maxlen=depth)

    def append(self, snapshot: PeriodSnapshot) -> None:
        """Adds the newest; drops the oldest when the ring is full."""
        self._snapshots.append(snapshot)

    def clear(self) -> None:
        """Drops all."""
        self._snapshots.clear()

    def newest(self) -> PeriodSnapshot | None:
        """Returns the latest complete period, None before the first."""
        return self._snapshots[-1] if self._snapshots else None

    def oldest_after(self, tick: int) -> PeriodSnapshot | None:
        """Returns the oldest snapshot with a tick above `tick`, None if there is none yet."""
        if not self._snapshots or self._snapshots[-1].tick <= tick:
            return None
        # Ticks in the ring are consecutive, so the index can be computed.
        place = max(tick + 1 - self._snapshots[0].tick, 0)
        return self._snapshots[place]

    def after(self, tick: int) -> list[PeriodSnapshot]:
        """Returns all kept snapshots with a tick above `tick`, oldest first."""
        return [snapshot for snapshot in self._snapshots if snapshot.tick > tick]
