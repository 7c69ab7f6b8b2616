"""Passes rows and events of a run to the trace and to a listener."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Protocol

from daq.contracts.sample import SampleCount, SampleRow
from daq.contracts.trace import EventKind, TraceEvent
from daq.traces.writer import TraceWriter


class RunListener(Protocol):
    """Receives progress, rows and events during a run. No method may block."""

    def progress(self, fraction: float, text: str) -> None:
        """Reports progress."""
        ...

    def sampled(self, joints: tuple[int, ...], row: SampleRow) -> None:
        """Receives a recorded control period."""
        ...

    def happened(self, event: TraceEvent) -> None:
        """Receives an event, which is also in the trace."""
        ...


@dataclass
class Recorder:
    """Records every row and event, and passes them to the listener."""

    writer: TraceWriter
    joints: tuple[int, ...]
    listener: RunListener
    every: int = 1
    """Control periods from one sample to the next."""
    last: int | None = None
    samples: int = 0
    missing: int = 0
    """Number of missing samples between the first and the last, counted as in `Trace.missing`."""
    count: SampleCount = field(init=False)

    def __post_init__(self) -> None:
        self.count = SampleCount(self.every)

    def row(self, row: SampleRow) -> None:
        """Records a control period. Raises TraceError."""
        if self.last is not None:
            self.missing += self.count.missing(row.tick - self.last)
        self.last = row.tick
        self.samples += 1
        self.writer.sample(row)
        self.listener.sampled(self.joints, row)

    def event(self, time: float, kind: EventKind, message: str, tick: int | None, joint: int | None = None) -> None:
        """Records an event. Raises TraceError."""
        event = TraceEvent(time=time, kind=kind, message=message, tick=tick, joint=joint)
        self.writer.event(event)
        self.listener.happened(event)


@dataclass
class ApproachObserver:
    """Observer of the move to the start: records nothing, and passes on all events except missing samples."""

    listener: RunListener

    def row(self, _row: SampleRow) -> None:
        """Ignores the row."""
        return

    def event(self, time: float, kind: EventKind, message: str, tick: int | None, joint: int | None = None) -> None:
        """Passes the event to the listener."""
        if kind != "missing":
            self.listener.happened(TraceEvent(time=time, kind=kind, message=message, tick=tick, joint=joint))
