"""Records a trace outside the acquisition loop: a bounded queue feeds a thread that writes and syncs."""

from __future__ import annotations

import math
import threading
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import Self

from daq.contracts.errors import TraceError
from daq.contracts.labels import Outcome
from daq.contracts.sample import SampleRow
from daq.contracts.trace import TraceEvent, TraceRecord
from daq.contracts.whole_file import sync_folder
from daq.traces import disk
from daq.traces.layout import RECORDED_SIGNALS, SLOW_LINE_SIGNALS
from daq.traces.naming import part_path
from daq.traces.recording import Recording

SYNC_INTERVAL = 0.8
"""Time (s) between syncs. At most 1.2 s of a record may be lost, so a slow disk has 0.4 s for one sync."""
QUEUE_LENGTH = 16384
"""Most samples and events that wait for the disk: five minutes at 50 Hz."""
ROWS_A_CHUNK = 2000
"""Rows after which a chunk ends before the next sync. Faster than real time, there may be many rows between two
syncs."""
WORTH_WAKING = 256
"""Waiting samples and events at which the thread is woken before the next sync. Waking it for each would take as long
as writing it."""


@dataclass(frozen=True)
class _Close:
    outcome: Outcome
    counters: Mapping[str, float]


class TraceWriter:
    """Writes a trace to `path`; until it is closed the file is named `path` + `.part`.

    `sample` and `event` only put data into a queue. If the disk is full, fails, or is a whole queue behind, the next
    call raises TraceError, which is also in `failure`. Everything synced before stays in the part file and can be
    salvaged. `lacks`: signals that this robot does not measure. `patience`: longest wait (s) of a call for room in the
    queue; 0 for acquisition in real time.

    Raises TraceError if the file cannot be made or exists. A `with` block that ends without `close` closes the trace as
    interrupted.
    """

    def __init__(
        self,
        path: Path,
        record: TraceRecord,
        joints: tuple[int, ...],
        *,
        attachments: Mapping[str, bytes] | None = None,
        lacks: Sequence[str] = (),
        sync_interval: float = SYNC_INTERVAL,
        queue_length: int = QUEUE_LENGTH,
        patience: float = 0.0,
    ) -> None:
        self.path = path
        self.part = part_path(path)
        self.synced_samples = 0
        self._joints = joints
        self._patience = patience
        self._sync_interval = sync_interval
        self._last: SampleRow | None = None
        self._failure: TraceError | None = None
        self._closed = False
        self._changed = threading.Condition()
        """Guards the waiting data and the close. It is notified of changes to either."""
        self._waiting: list[SampleRow | TraceEvent] = []
        self._longest = queue_length
        self._wake_at = min(WORTH_WAKING, queue_length)
        self._close_with: _Close | None = None
        if path.exists():
            raise TraceError(f"{path}: exists already; a trace is never written over")
        try:
            self._stream = disk.create_locked(self.part)
        except OSError as error:
            raise TraceError(f"{path}: cannot be made: {disk.reason(error)}") from error
        try:
            recorded = RECORDED_SIGNALS if record.every == 1 else SLOW_LINE_SIGNALS
            signals = tuple(name for name in recorded if name not in lacks)
            self._recording = Recording(self._stream, record, joints, signals, attachments or {})
            disk.sync(self._stream)
            sync_folder(path.parent)
        except BaseException as error:
            self._release()
            self.part.unlink()
            if isinstance(error, OSError):
                raise TraceError(f"{path}: cannot be written: {disk.reason(error)}") from error
            raise
        self._thread = threading.Thread(target=self._run, name=f"writer of {path.name}", daemon=True)
        self._thread.start()

    @property
    def failure(self) -> TraceError | None:
        """The first error; None if there is none."""
        return self._failure

    def sample(self, row: SampleRow) -> None:
        """Records one control period. Raises TraceError if writing failed, or if the row cannot follow the previous
        one."""
        self._check(row)
        self._last = row
        self._put(row)

    def event(self, event: TraceEvent) -> None:
        """Records an event. Raises TraceError if writing failed or the event's time is not finite."""
        if not math.isfinite(event.time):
            raise TraceError(f"{self.path}: event {event.kind!r} has time {event.time}, which is not finite")
        self._put(event)

    def close(self, outcome: Outcome, counters: Mapping[str, float] | None = None) -> Path:
        """Writes all waiting data, finishes the file and renames it to `path`, which it returns.

        Raises TraceError if that failed; the part file then stays for `salvage`.
        """
        if self._closed:
            raise TraceError(f"{self.path}: is closed already")
        self._closed = True
        with self._changed:
            self._close_with = _Close(outcome, counters or {})
            self._changed.notify_all()
        self._thread.join()
        self._release()
        if self._failure is not None:
            raise self._failure
        return self.path

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._closed:
            return
        try:
            self.close("interrupted")
        except TraceError:
            if error is None:
                raise

    def _check(self, row: SampleRow) -> None:
        count = len(self._joints)
        floats = (row.set_point, row.position, row.error, row.drive)
        if any(len(signal) != count for signal in (*floats, row.power_raw)) or len(row.velocity) not in (0, count):
            raise TraceError(f"{self.path}: tick {row.tick} does not have {count} values of each signal")
        if not math.isfinite(row.time + row.host_time + sum(map(sum, floats)) + sum(row.velocity)):
            raise TraceError(f"{self.path}: tick {row.tick} has a value that is not finite")
        if self._last is not None and (row.tick <= self._last.tick or row.time <= self._last.time):
            raise TraceError(f"{self.path}: tick {row.tick} came after tick {self._last.tick}")

    def _put(self, item: SampleRow | TraceEvent) -> None:
        if self._failure is not None:
            raise self._failure
        if self._closed:
            raise TraceError(f"{self.path}: is closed already")
        with self._changed:
            if len(self._waiting) >= self._longest:
                self._changed.wait_for(lambda: len(self._waiting) < self._longest, self._patience)
            if len(self._waiting) >= self._longest:
                raise self._fail(f"the disk is {self._longest} samples and events behind")
            self._waiting.append(item)
            if len(self._waiting) == self._wake_at:
                self._changed.notify_all()

    def _fail(self, what: str) -> TraceError:
        """Stores the first failure; later calls raise it."""
        if self._failure is None:
            self._failure = TraceError(f"{self.path}: cannot be written: {what}; what came before is in {self.part}")
        return self._failure

    def _run(self) -> None:
        try:
            self._write_until_closed()
        except OSError as error:
            self._fail(disk.reason(error))
            self._refuse_what_waits()
        except BaseException as error:
            self._fail(f"{type(error).__name__}: {error}")
            self._refuse_what_waits()
            raise

    def _refuse_what_waits(self) -> None:
        """Empties the queue, so that an acquisition that waits for room gets the error at its next call."""
        with self._changed:
            self._waiting = []
            self._changed.notify_all()

    def _write_until_closed(self) -> None:
        next_sync = time.monotonic() + self._sync_interval
        unsynced = rows = 0
        while True:
            items, close = self._next(next_sync)
            for item in items:
                if isinstance(item, SampleRow):
                    self._recording.row(item)
                    unsynced, rows = unsynced + 1, rows + 1
                elif item is not None:
                    self._recording.event(item)
                    unsynced += 1
                if time.monotonic() >= next_sync:
                    next_sync = time.monotonic() + self._sync_interval
                    if unsynced:
                        self._sync()
                    unsynced = rows = 0
                elif rows >= ROWS_A_CHUNK:
                    self._recording.flush()
                    rows = 0
            if close is not None:
                return self._finish(close)

    def _next(self, until: float) -> tuple[Sequence[SampleRow | TraceEvent | None], _Close | None]:
        """Waits until enough data wait, until `until` (s, monotonic), or until the close. Returns the waiting data
        (None if there is none), and the close."""
        with self._changed:
            self._changed.wait_for(
                lambda: len(self._waiting) >= self._wake_at or self._close_with is not None,
                max(0.0, until - time.monotonic()),
            )
            items, self._waiting = self._waiting, []
            if len(items) >= self._longest:
                self._changed.notify_all()
            return items or (None,), self._close_with

    def _sync(self) -> None:
        self._recording.flush()
        disk.sync(self._stream)
        self.synced_samples = self._recording.samples

    def _finish(self, close: _Close) -> None:
        if self._failure is not None:
            # Samples were refused. The accepted ones are kept, but the trace must not count as finished.
            return self._sync()
        self._recording.finish(close.outcome, close.counters)
        disk.sync(self._stream)
        disk.rename(self.part, self.path, self._stream)
        self.synced_samples = self._recording.samples
        return None

    def _release(self) -> None:
        try:
            self._stream.close()
        except OSError:
            # The write error has been reported; closing would only try the same bytes again.
            return
