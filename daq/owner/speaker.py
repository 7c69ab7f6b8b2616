"""Sends reports to the client outside the control loop, so that a client that does not read delays nothing."""

from __future__ import annotations

import os
import queue
import threading
from types import TracebackType
from typing import Self

from pydantic import BaseModel

from daq.contracts.sample import SampleRow
from daq.contracts.trace import TraceEvent
from daq.owner.messages import EventHappened, Progress

WAITING_REPORTS = 4096
"""Most reports that wait for a client that does not read (80 s of samples); further reports are dropped."""


class Speaker:
    """Writes reports to a descriptor, one per line, on a separate thread. If the reader is gone, reports are dropped.

    The last report is never dropped: leaving the `with` block waits until it is written.
    """

    def __init__(self, output: int) -> None:
        self.dropped = 0
        """Number of reports that were dropped. The first report after them tells the client."""
        self._output = output
        self._queue: queue.Queue[BaseModel | None] = queue.Queue(WAITING_REPORTS)
        self._thread = threading.Thread(target=self._write_all, name="reports", daemon=True)

    def __enter__(self) -> Self:
        self._thread.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._queue.put(None)
        self._thread.join()

    def ended(self, report: BaseModel) -> None:
        """Sends the last report; waits for room."""
        self._queue.put(report)

    def progress(self, fraction: float, text: str) -> None:
        """Reports the progress of the run."""
        self.say(Progress(fraction=fraction, text=text))

    def happened(self, event: TraceEvent) -> None:
        """Reports an event."""
        self.say(EventHappened(event=event))

    def sampled(self, joints: tuple[int, ...], row: SampleRow) -> None:
        """Does nothing: the controller's listener reports samples."""

    def say(self, report: BaseModel) -> None:
        """Sends a report, or drops and counts it if the queue is full."""
        try:
            self._queue.put_nowait(report)
        except queue.Full:
            self.dropped += 1

    def _send(self, report: BaseModel) -> None:
        data = report.model_dump_json().encode() + b"\n"
        # Bypass Python's buffer: it would retry unwritten data at exit, and report the error.
        while data:
            data = data[os.write(self._output, data) :]

    def _write_all(self) -> None:
        heard, told = True, 0
        while (report := self._queue.get()) is not None:
            if not heard:
                continue
            try:
                if (dropped := self.dropped) > told:
                    line = f"{dropped - told} reports of the arm are lost: their reader was too slow"
                    self._send(EventHappened(event=TraceEvent(time=0.0, kind="missing", message=line)))
                    told = dropped
                self._send(report)
            except OSError:
                heard = False
