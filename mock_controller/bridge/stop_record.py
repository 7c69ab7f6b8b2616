"""Times of a stop: received, stored in the memory, used by the controller."""

from __future__ import annotations

from dataclasses import dataclass

from mock_controller.board.snapshot import SnapshotRing


@dataclass
class StopRecord:
    """Times of the latest stop, in board time (µs); None for events that have not happened."""

    count: int = 0
    received_us: int | None = None
    """When the whole request had arrived."""
    frozen_us: int | None = None
    """When the last byte of the frozen set points was in the memory."""
    frozen_tick: int | None = None
    """The last period that had begun by then."""
    first_used_us: int | None = None
    """When the first period began that used the frozen set points."""
    first_used_tick: int | None = None

    @property
    def unused(self) -> bool:
        """Whether a stop waits for a period that uses its set points."""
        return self.frozen_us is not None and self.first_used_us is None

    def note(self, received_us: int, frozen_us: int, tick: int) -> None:
        """Records a stop that was carried out."""
        self.count += 1
        self.received_us, self.frozen_us, self.frozen_tick = received_us, frozen_us, tick
        self.first_used_us = self.first_used_tick = None

    def look(self, snapshots: SnapshotRing) -> None:
        """Looks for the first complete period that used the frozen set points."""
        if self.frozen_us is None or self.frozen_tick is None or self.first_used_us is not None:
            return
        candidate = snapshots.oldest_after(self.frozen_tick)
        while candidate is not None and (candidate.set_point_missed or candidate.time_us < self.frozen_us):
            candidate = snapshots.oldest_after(candidate.tick)
        if candidate is not None:
            self.first_used_us, self.first_used_tick = candidate.time_us, candidate.tick
