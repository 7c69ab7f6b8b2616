"""Reports on their way to the client, off the control loop: a client that does not read delays nothing."""

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
"""Reports that may wait for a parent that does not read (80 s of samples); those beyond are not told."""


class Speaker:
    """Writes reports to a descriptor, one a line, on a thread of its own; a reader that has gone stops nobody.

    The end of the run is told however long the reader takes: leaving the `with` block waits for it.
    """

    def __init__(self, output: int) -> None:
        self.untold = 0
        """Reports that found no room."""
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
        """The last report; waits for room."""
        self._queue.put(report)

    def progress(self, fraction: float, text: str) -> None:
        """How far the run is."""
        self.say(Progress(fraction=fraction, text=text))

    def happened(self, event: TraceEvent) -> None:
        """An event."""
        self.say(EventHappened(event=event))

    def sampled(self, joints: tuple[int, ...], row: SampleRow) -> None:
        """Nothing: the controller's listener reports samples, whoever reads them."""

    def say(self, report: BaseModel) -> None:
        """Any report; one that finds no room is counted."""
        try:
            self._queue.put_nowait(report)
        except queue.Full:
            self.untold += 1

    def _write(self, data: bytes) -> None:
        # Past Python's own buffer: what is left there would be tried again, and complained about, at exit.
        while data:
            data = data[os.write(self._output, data) :]

    def _write_all(self) -> None:
        heard = True
        while (report := self._queue.get()) is not None:
            if not heard:
                continue
            try:
                self._write(report.model_dump_json().encode() + b"\n")
            except OSError:
                heard = False
