"""Keeps the catalogue's table consistent with the folder: adds new and salvaged files, and marks missing ones."""

from __future__ import annotations

import logging
import shutil
import threading
import time
from contextlib import suppress
from pathlib import Path

from sqlalchemy.exc import OperationalError

from daq.contracts.errors import TraceError
from daq.contracts.trace_limits import DEFAULT_TRACE_LIMITS, TraceLimits
from daq.contracts.whole_file import sync_folder
from daq.traces import disk, layout
from daq.traces.catalogue import TraceSummary, summary_of
from daq.traces.reader import read_trace
from daq.traces.salvage import salvage_folder
from daq.traces.summary import joints_moved
from server.problems import ProblemError, conflict, not_found
from server.store.experiments import ExperimentStore
from server.store.traces import TraceStore

UPLOAD = ".upload-"
"""Prefix of the name of a folder for an upload."""
UPLOAD_IS_OLD = 2 * 3600.0
"""Time (s) after which such a folder is no longer used, since its reader has at most an hour."""
log = logging.getLogger("server.catalogue")
SHOWN = 200
"""Most characters of an error in the log."""


def is_text(name: str) -> bool:
    """Whether a file name is valid UTF-8, as the database requires."""
    return not any("\ud800" <= sign <= "\udfff" for sign in name)


class Catalogue:
    """One folder and its table. Safe to use from any thread."""

    def __init__(
        self,
        folder: Path,
        robot: str,
        traces: TraceStore,
        experiments: ExperimentStore,
        limits: TraceLimits = DEFAULT_TRACE_LIMITS,
    ) -> None:
        self.folder = folder
        self._robot = robot
        self._traces = traces
        self._experiments = experiments
        self._lock = threading.Lock()
        self.limits = limits

    def bring_up_to_date(self) -> int:
        """Salvages traces that a crash left unfinished, and adds every file that is not in the table. Returns the
        number of added files."""
        self.folder.mkdir(parents=True, exist_ok=True)
        with self._lock:
            for salvaged in salvage_folder(self.folder, self.limits):
                if salvaged.problem:
                    log.warning("salvage: %s", salvaged.problem)
                else:
                    log.info("salvaged %s: %s samples", salvaged.path, salvaged.samples)
            there = {entry.name for entry in self.folder.iterdir() if entry.name.endswith(layout.SUFFIX)}
            known = self._traces.files(self._robot)
            self._traces.mark_missing(self._robot, known - there, missing=True)
            self._traces.mark_missing(self._robot, known & there, missing=False)
            return sum(self._take_in(self.folder / name) is not None for name in sorted(there - known))

    def clear_uploads(self) -> None:
        """Deletes the folders of interrupted uploads. Recent ones may belong to another service that uses this
        folder."""
        old = time.time() - UPLOAD_IS_OLD
        for left in self.folder.glob(f"{UPLOAD}*"):
            with suppress(OSError):  # another service may be deleting it
                if left.is_dir() and not left.is_symlink() and left.stat().st_mtime < old:
                    shutil.rmtree(left)
                    log.info("deleted %s: its upload was interrupted", left)

    def add(self, path: Path) -> str | None:
        """Adds one finished file. Returns the trace's ID; None if the file is not a trace, which is logged."""
        with self._lock:
            summary = self._take_in(path)
        return None if summary is None else summary.trace_id

    def move_in(self, source: Path, target: Path, summary: TraceSummary) -> bool:
        """Moves a finished file with this summary from elsewhere on the disk to `target` in the folder, and adds it.
        Returns False, and changes nothing, if a trace with its ID exists. Raises a 409 if `target` exists."""
        with self._lock:  # other threads see both file and row, or neither
            if target.exists():
                advice = "it is the same trace: nothing needs to be done"
                raise conflict("trace-exists", f"{target.name} exists already", advice)
            taken = False
            try:
                disk.rename(source, target)
                taken = self._insert(target, summary)
            finally:
                if not taken:
                    target.unlink(missing_ok=True)
            if taken:  # even if this fails, the trace is in the catalogue, with file and row
                self._tell(summary)
            return taken

    def remove(self, identity: str) -> Path:
        """Deletes a trace permanently, even if its file is gone, and returns the file's path. Raises a 404, a 409 if
        the trace is used, and OSError if the file cannot be deleted; nothing has changed then."""
        path = self.folder / self._traces.file_of(self._robot, identity)

        def take_away() -> None:
            path.unlink(missing_ok=True)
            sync_folder(self.folder)

        with self._lock:
            self._traces.remove(self._robot, identity, take_away)
        return path

    def path_of(self, identity: str) -> Path:
        """Returns the file of a trace. Raises a 404, also if the file is gone."""
        path = self.folder / self._traces.file_of(self._robot, identity)
        if not path.is_file():
            advice = "it was removed from the folder of traces: upload it again, or delete the trace"
            raise not_found(f"file for trace {identity!r} any more", advice)
        return path

    def _take_in(self, path: Path) -> TraceSummary | None:
        """Adds one file. An error is logged, so that one file does not exclude the others. Raises OperationalError if
        the database fails."""
        try:
            if not is_text(path.name):
                log.warning("not in the catalogue: %r: its name is not UTF-8; rename it", str(path))
                return None
            summary = self._summary(path)
            if summary is None or not self._insert(path, summary):
                return None
        except OperationalError:
            raise
        except Exception as error:  # noqa: BLE001  # one file must not prevent the service from starting
            line = " ".join(str(error).split())[:SHOWN]
            log.warning("not in the catalogue: %s: %s: %s", path, type(error).__name__, line)
            return None
        self._tell(summary)
        return summary

    def _tell(self, summary: TraceSummary) -> None:
        """Passes the outcome to the trace's experiment, if there is one."""
        assert summary.trace_id is not None
        self._experiments.traced(summary.trace_id, summary.outcome)

    def _summary(self, path: Path) -> TraceSummary | None:
        try:
            summary = summary_of(path, self.limits)
        except FileNotFoundError:
            return None
        if summary.state != "finished" or summary.trace_id is None:
            log.warning("not in the catalogue: %s", summary.problem or f"{path} is {summary.state}")
            return None
        return summary

    def _insert(self, path: Path, summary: TraceSummary) -> bool:
        assert summary.trace_id is not None
        moved = summary.moved
        # No whole experiment says it. Samples that cannot be read say so when the trace is opened.
        if moved is None or summary.outcome != "complete":
            with suppress(TraceError):
                moved = joints_moved(read_trace(path, self.limits))
        try:
            self._traces.insert(
                self._robot,
                summary.model_copy(update={"path": path, "moved": moved}),
                self._experiments.of_trace(summary.trace_id),
                lambda file: (self.folder / file).is_file(),
            )
        except ProblemError as error:
            log.warning("not in the catalogue: %s: %s", path, error)
            return False
        return True
