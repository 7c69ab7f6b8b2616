"""An archive behind a folder of traces, with its own threads, on a store that may fail."""

import threading
from collections.abc import Callable
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any

from daq.traces.csv_table import import_csv
from daq.traces.naming import trace_path
from daq.traces.store import write_trace
from extras.lab.archive.archived import ArchivedStore
from extras.lab.archive.bucket import Bucket
from extras.lab.archive.service import ArchiveContext, ArchiveService
from server.catalogue.catalogue import Catalogue
from server.clock import SystemClock
from server.store.experiments import ExperimentStore
from server.store.traces import TraceStore
from tests.extras.lab.archive.store import CREDENTIALS, settings_of
from tests.server.migrated import migrated_store

ROBOT = "ma2000"
QUICK = (0.01, 0.05)
"""Pauses (s) after failures."""


class TurnedClock(SystemClock):
    """The computer's clock, with a wall clock that is ahead."""

    ahead = timedelta(0)
    turned = 0.0
    """Time (s) by which its monotonic clock is ahead."""

    def utc(self) -> datetime:
        return datetime.now(UTC) + self.ahead

    def monotonic(self) -> float:
        """Since an arbitrary start."""
        return super().monotonic() + self.turned


class Bench:
    """`told` are the archive's events, `counted` its transfers."""

    def __init__(self, folder: Path, bucket: str, url: str, **settings: Any) -> None:
        self.folder = folder
        self.store = migrated_store(folder / "service.sqlite")
        self.traces = TraceStore(self.store)
        self.traces.archive_index = self.archive_index = ArchivedStore(self.store)
        self.catalogue = Catalogue(folder / "traces", ROBOT, self.traces, ExperimentStore(self.store))
        self.catalogue.folder.mkdir(exist_ok=True)
        self.clock = TurnedClock()
        self.told: list[str] = []
        self.counted: list[tuple[str, str, int]] = []
        self._changed = threading.Condition()
        found = settings_of(bucket, url, **settings)
        self.service = ArchiveService(
            ArchiveContext(
                robot=ROBOT,
                settings=found,
                bucket=Bucket(found, CREDENTIALS),
                catalogue=self.catalogue,
                archived=self.archive_index,
                clock=self.clock,
                tell=self._tell,
                fetched=self._change,
                count=self._count,
                pauses=QUICK,
            )
        )
        self.catalogue.archive = self.service
        self._made = 0

    def _tell(self, line: str) -> None:
        self.told.append(line)
        self._change()

    def _count(self, direction: str, result: str, size: int) -> None:
        self.counted.append((direction, result, size))
        self._change()

    def _change(self) -> None:
        with self._changed:
            self._changed.notify_all()

    def trace(self, samples: int = 50) -> str:
        """A new trace in the folder and in the catalogue. Its number."""
        self._made += 1
        table = self.folder / "table.csv"
        rows = (f"{0.02 * n:.2f},{0.001 * n * self._made}" for n in range(samples))
        table.write_text("time,position_1\n" + "\n".join(rows), "utf-8")
        trace = import_csv(table)
        path = trace_path(self.catalogue.folder, trace.record)
        write_trace(trace, path)
        self.catalogue.add(path)
        return str(trace.record.trace_id)

    def path(self, trace: str) -> Path:
        """Where its file is, or would be."""
        return self.catalogue.folder / self.traces.file_of(ROBOT, trace)

    def until(self, is_so: Callable[[], bool]) -> None:
        """Waits for something that the archive's threads do; the test's own time limit ends the wait."""
        with self._changed:
            while not self._changed.wait_for(is_so, 0.02):
                pass

    def until_archived(self, *traces: str) -> None:
        """Waits until the archive has these traces."""
        self.until(lambda: all(self.archive_index.get(trace) is not None for trace in traces))

    def nobody_reads(self) -> None:
        """As when ten minutes have passed since somebody opened a trace."""
        self.catalogue._opened.clear()

    def close(self) -> None:
        """Ends it, as the service does."""
        self.service.close(5.0)
        self.store.close()
