"""Rows and events of a run go into the trace and to a listener."""

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
    """Records every row and event, and passes it on to the listener."""

    writer: TraceWriter
    joints: tuple[int, ...]
    listener: RunListener
    every: int = 1
    """Control periods from one sample to the next."""
    last: int | None = None
    samples: int = 0
    missing: int = 0
    """Number of samples that are not there between the first and the last, counted as `Trace.missing` counts them."""
    count: SampleCount = field(init=False)

    def __post_init__(self) -> None:
        self.count = SampleCount(self.every)

    def row(self, row: SampleRow) -> None:
        """A control period. Raises TraceError."""
        if self.last is not None:
            self.missing += self.count.missing(row.tick - self.last)
        self.last = row.tick
        self.samples += 1
        self.writer.sample(row)
        self.listener.sampled(self.joints, row)

    def event(self, time: float, kind: EventKind, message: str, tick: int | None, joint: int | None = None) -> None:
        """An event. Raises TraceError."""
        event = TraceEvent(time=time, kind=kind, message=message, tick=tick, joint=joint)
        self.writer.event(event)
        self.listener.happened(event)


@dataclass
class ApproachObserver:
    """Observer of the move to the start: passes events on, except missing samples, and records nothing."""

    listener: RunListener

    def row(self, _row: SampleRow) -> None:
        """Ignored."""
        return

    def event(self, time: float, kind: EventKind, message: str, tick: int | None, joint: int | None = None) -> None:
        """Passed on to the listener."""
        if kind != "missing":
            self.listener.happened(TraceEvent(time=time, kind=kind, message=message, tick=tick, joint=joint))
