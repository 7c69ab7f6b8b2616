"""Finds set points that the controller missed: what a snapshot shows it used is not what was sent (section 6.3)."""

from __future__ import annotations

import threading
from collections.abc import Mapping
from dataclasses import dataclass, field

from firmware_protocol.commands import JointReading


@dataclass(eq=False)
class SentSetPoints:
    """All set points in force after one batch was sent. From period `due` on the controller must show them, or later
    ones; None as long as nobody has confirmed them."""

    postures: dict[int, int]
    due: int | None = None

    def shown_by(self, joints: tuple[tuple[int, JointReading], ...]) -> bool:
        """Whether the controller used these set points in a period."""
        return all(reading.set_point == self.postures[joint] for joint, reading in joints if joint in self.postures)


@dataclass(frozen=True)
class Used:
    """What is known of the set points that a period used.

    missed: they are older than those that were due; never while nothing is due
    since:  the first period that used them; None where that is not known
    """

    missed: bool = False
    since: int | None = None


@dataclass
class SetPointWatch:
    """What has been sent, in order.

    A batch that the board confirmed with tick T was in its memory before period T+1 began, so T+1 must show it; the
    period in which it arrives may or may not. That is the pipeline of one period: a snapshot is right when it shows
    the newest batch that was due, or any sent after that one. Anything older has been missed. Batches are sent as
    increments upon those before, so each entry holds the set points of all joints commanded so far.

    A snapshot's set point is what the board says it took or, read from the memory, what position + error come to.
    The detection is exact where the board's ticks are known. With the host's own estimate of ticks a batch is due one
    period later, and a single miss amid a stream of new set points may pass for a late arrival.
    """

    _sent: list[SentSetPoints] = field(default_factory=list)
    _lock: threading.Lock = field(default_factory=threading.Lock)

    def sending(self, postures: Mapping[int, int]) -> SentSetPoints:
        """Records a batch that is about to be written: from now on snapshots may show it."""
        with self._lock:
            before = self._sent[-1].postures if self._sent else {}
            batch = SentSetPoints({**before, **postures})
            self._sent.append(batch)
            return batch

    def confirmed(self, batch: SentSetPoints, due: int) -> None:
        """Records that the board has confirmed a batch: from period `due` on snapshots must show it."""
        with self._lock:
            batch.due = due

    def withdrawn(self, batch: SentSetPoints) -> None:
        """Records that the board has refused a batch."""
        with self._lock:
            if batch in self._sent:
                self._sent.remove(batch)

    def replaced(self, postures: Mapping[int, int], due: int) -> None:
        """Records that a stop has put other set points in force; what was sent before no longer counts."""
        with self._lock:
            self._sent = [*self._sent[-1:], SentSetPoints(dict(postures), due)]

    def forget(self) -> None:
        """Forgets everything: the set points in force are unknown."""
        with self._lock:
            self._sent.clear()

    def seen(self, tick: int, joints: tuple[tuple[int, JointReading], ...]) -> Used:
        """Judges the set points that period `tick` used."""
        with self._lock:
            due = [i for i, batch in enumerate(self._sent) if batch.due is not None and batch.due <= tick]
            if not due:
                return Used()
            del self._sent[: due[-1]]
            shown = next((batch for batch in self._sent if batch.shown_by(joints)), None)
            if shown is None:
                return Used(missed=True)
            return Used(since=None if shown.due is None else min(shown.due, tick))
