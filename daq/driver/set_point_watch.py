"""Detects missed set points: a snapshot shows that the controller used others than were sent (section 6.3)."""

from __future__ import annotations

import threading
from collections.abc import Mapping
from dataclasses import dataclass, field

from firmware_protocol.joints import JointReading


@dataclass(eq=False)
class SentSetPoints:
    """All set points in force after a batch was sent. From period `due` on the controller must show these or later
    ones; `due` is None until the batch is confirmed."""

    postures: dict[int, int]
    due: int | None = None

    def shown_by(self, joints: tuple[tuple[int, JointReading], ...]) -> bool:
        """Whether the controller used these set points in a period."""
        return all(reading.set_point == self.postures[joint] for joint, reading in joints if joint in self.postures)


@dataclass(frozen=True)
class Used:
    """Set points that a period used.

    missed: they are older than the ones that were due; False while none is due
    since:  the first period that used them; None if unknown
    """

    missed: bool = False
    since: int | None = None


@dataclass
class SetPointWatch:
    """Records the set points that were sent, in order.

    If the board confirmed a batch with tick T, the batch was in its memory before period T+1 began, so T+1 must show
    it. The period in which it arrives may or may not show it. A snapshot is therefore correct if it shows the newest
    due batch, or a later one. An older batch means that set points were missed. A batch changes some joints, so each
    entry holds the set points of all joints commanded so far.

    A snapshot's set point is the one that the board says it used or, read from the memory, the sum of position and
    error. The detection is exact if the board's ticks are known. With ticks estimated by the host, a batch is due one
    period later, and a single miss within a stream of new set points may look like a late arrival.
    """

    _sent: list[SentSetPoints] = field(default_factory=list)
    _lock: threading.Lock = field(default_factory=threading.Lock)

    def sending(self, postures: Mapping[int, int]) -> SentSetPoints:
        """Records a batch that is about to be written: snapshots may show it from now on."""
        with self._lock:
            before = self._sent[-1].postures if self._sent else {}
            batch = SentSetPoints({**before, **postures})
            self._sent.append(batch)
            return batch

    def confirmed(self, batch: SentSetPoints, due: int) -> None:
        """Records that the board confirmed a batch: snapshots must show it from period `due` on."""
        with self._lock:
            batch.due = due

    def withdrawn(self, batch: SentSetPoints) -> None:
        """Records that the board refused a batch."""
        with self._lock:
            if batch in self._sent:
                self._sent.remove(batch)

    def replaced(self, postures: Mapping[int, int], due: int) -> None:
        """Records that a stop replaced the set points in force; earlier ones no longer count."""
        with self._lock:
            self._sent = [*self._sent[-1:], SentSetPoints(dict(postures), due)]

    def forget(self) -> None:
        """Clears all records: the set points in force are unknown."""
        with self._lock:
            self._sent.clear()

    def seen(self, tick: int, joints: tuple[tuple[int, JointReading], ...]) -> Used:
        """Checks the set points that period `tick` used."""
        with self._lock:
            due = [i for i, batch in enumerate(self._sent) if batch.due is not None and batch.due <= tick]
            if not due:
                return Used()
            del self._sent[: due[-1]]
            shown = next((batch for batch in self._sent if batch.shown_by(joints)), None)
            if shown is None:
                return Used(missed=True)
            return Used(since=None if shown.due is None else min(shown.due, tick))
