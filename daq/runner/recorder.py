"""Where rows and events go: into the trace, and to whoever listens."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

from daq.contracts.sample import SampleRow
from daq.contracts.trace import EventKind, TraceEvent
from daq.traces.writer import TraceWriter


class Ears(Protocol):
    """Who listens while a run goes on. None of it may wait for anybody."""

    def progress(self, fraction: float, text: str) -> None:
        """How far the run is."""
        ...

    def sampled(self, joints: tuple[int, ...], row: SampleRow) -> None:
        """A recorded control period."""
        ...

    def happened(self, event: TraceEvent) -> None:
        """An event that is in the trace too."""
        ...


@dataclass
class Recorder:
    """Everything, recorded and told."""

    writer: TraceWriter
    joints: tuple[int, ...]
    ears: Ears
    first: int | None = None
    last: int = 0
    samples: int = 0

    def row(self, row: SampleRow) -> None:
        """A control period. Raises TraceError."""
        if self.first is None:
            self.first = row.tick
        self.last = row.tick
        self.samples += 1
        self.writer.sample(row)
        self.ears.sampled(self.joints, row)

    def event(self, time: float, kind: EventKind, message: str, tick: int | None, joint: int | None = None) -> None:
        """An event. Raises TraceError."""
        event = TraceEvent(time=time, kind=kind, message=message, tick=tick, joint=joint)
        self.writer.event(event)
        self.ears.happened(event)

    @property
    def missing(self) -> int:
        """Periods between the first and the last that have no sample."""
        return 0 if self.first is None else self.last - self.first + 1 - self.samples


@dataclass
class ToldOnly:
    """On the way to the start nothing is recorded, and samples that are missing are nobody's loss."""

    ears: Ears

    def row(self, _row: SampleRow) -> None:
        """Nothing."""
        return

    def event(self, time: float, kind: EventKind, message: str, tick: int | None, joint: int | None = None) -> None:
        """Told."""
        if kind != "missing":
            self.ears.happened(TraceEvent(time=time, kind=kind, message=message, tick=tick, joint=joint))
