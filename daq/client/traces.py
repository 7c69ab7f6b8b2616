"""Traces: search, look into, download, upload, tag."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from datetime import datetime
from pathlib import Path

from daq.client.connection import PART, Connection, Request
from daq.client.errors import ServiceError
from daq.contracts.errors import TraceError
from daq.contracts.labels import Outcome, Source
from daq.contracts.service.archive import ArchiveOrder, ArchiveStatus, TraceArchive, Transfer
from daq.contracts.service.problems import ProblemDetails
from daq.contracts.service.teaching import MeasuredGain
from daq.contracts.service.traces import CatalogueEntry, TraceChange, TraceDetails, TraceSignals

LAST = "last"
"""Name of the newest trace, in place of its number."""
MCAP = b"\x89MCAP0\r\n"
"""First bytes of a file of MCAP."""
KINDS = {".mcap": "application/octet-stream", ".csv": "text/csv"}
MOST_NAMED = 4
"""Number of traces named in the error about an ambiguous beginning."""
FETCH_LOOK = 0.5
"""Pause (s) between two looks at a trace that the service fetches from its archive."""
Progress = Callable[[Transfer], None]
UPLOAD_WITHIN = 600.0
"""Time-out (s) for the answer to an upload."""


class Traces:
    """The service's catalogue."""

    def __init__(self, connection: Connection, robot: str) -> None:
        self._connection = connection
        self._robot = robot
        self._path = f"{robot}/traces"

    def list(
        self,
        text: str | None = None,
        *,
        tag: str | None = None,
        source: Source | None = None,
        outcome: Outcome | None = None,
        kind: str | None = None,
        since: datetime | None = None,
        until: datetime | None = None,
    ) -> Iterator[CatalogueEntry]:
        """The newest first; `text` is looked for in number, file, name, kind, operator, notes and tags."""
        return self._connection.every(
            CatalogueEntry,
            self._path,
            q=text,
            tag=tag,
            source=source,
            outcome=outcome,
            kind=kind,
            since=None if since is None else since.isoformat(),
            until=None if until is None else until.isoformat(),
        )

    def get(self, trace: str) -> TraceDetails:
        """A trace's description, figures and events."""
        return self._connection.get(TraceDetails, f"{self._path}/{trace}")

    def find(self, wanted: str) -> CatalogueEntry:
        """The one that `wanted` names: `last`, or the beginning of a number or of a file's name, as on the command
        line. Raises TraceError when there is none, or when several begin so."""
        if wanted == LAST:
            newest = next((entry for entry in self.list() if not entry.missing), None)
            if newest is None:
                raise TraceError("the service has no trace yet")
            return newest
        found = [one for one in self.list(wanted[:100]) if one.id.startswith(wanted) or one.file.startswith(wanted)]
        exact = [entry for entry in found if entry.id == wanted]
        if not found:
            raise TraceError(f"trace {wanted!r}: none of the service has a number or name that begins so")
        if len(found) > 1 and not exact:
            names = ", ".join(entry.file for entry in found[:MOST_NAMED])
            raise TraceError(f"trace {wanted!r}: {len(found)} traces of the service begin so: {names}; give more of it")
        return exact[0] if exact else found[0]

    def archive(self) -> ArchiveStatus:
        """The state of the archive. Raises ServiceError (`no-archive`) where there is none."""
        return self._connection.get(ArchiveStatus, f"{self._robot}/archive")

    def archived(self, trace: str) -> TraceArchive:
        """Where a trace is, and how far it is on its way to the archive or back."""
        return self._connection.get(TraceArchive, f"{self._path}/{trace}/archive")

    def send_to_archive(self, trace: str, *, drop: bool = False) -> TraceArchive:
        """Has a trace sent now; with `drop`, the service's local copy goes when the archive has it. Does not wait."""
        request = Request("POST", f"{self._path}/{trace}/archive", ArchiveOrder(drop=drop), repeatable=True)
        return self._connection.ask(TraceArchive, request)

    def fetch(self, trace: str, progress: Progress = lambda _transfer: None) -> TraceArchive:
        """Has a trace fetched from the archive, and waits until the service has it; `progress` is called meanwhile.

        Raises ServiceError when it cannot be fetched. While the archive is away, this waits.
        """
        request = Request("POST", f"{self._path}/{trace}/fetch", repeatable=True)
        found = self._connection.ask(TraceArchive, request)
        while not found.local:
            if found.transfer is None:  # somebody else was told that it failed
                found = self._connection.ask(TraceArchive, request)
            else:
                progress(found.transfer)
                if found.transfer.state == "failed":
                    line = found.transfer.problem
                    problem = ProblemDetails(type="#archive", title="Not available", status=503, detail=line)
                    raise ServiceError(problem)
            self._connection.pause(FETCH_LOOK)
            found = self.archived(trace)
        return found

    def _details(self, trace: str) -> TraceDetails:
        """The same as `get`, after the service has fetched the trace from the archive, where it has to."""
        try:
            return self.get(trace)
        except ServiceError as error:
            if error.kind != "trace-in-archive":
                raise
            self.fetch(trace)
            return self.get(trace)

    def _download(self, trace: str, name: str, target: Path, progress: Progress) -> None:
        """Downloads a file of a trace, which the service fetches from the archive before, where it has to."""
        path = f"{self._path}/{trace}/{name}"
        try:
            self._connection.download(path, target)
        except ServiceError as error:
            if error.kind != "trace-in-archive":
                raise
            self.fetch(trace, progress)
            self._connection.download(path, target)

    def download(self, trace: str, target: Path, progress: Progress = lambda _transfer: None) -> Path:
        """The file as it was recorded: to `target`, or under its own name where that is a folder. `progress` is called
        while the service fetches it from the archive.

        Returns the file. Raises TraceError when another one is there, or it cannot be written.
        """
        target = Path(target)
        if target.is_dir():
            target = target / Path(self._details(trace).entry.file).name
        try:
            if not target.exists():
                self._download(trace, "data.mcap", target, progress)
                return target
            fetched = target.with_name(f".{target.name}.fetched")
            try:
                self._download(trace, "data.mcap", fetched, progress)
                if fetched.read_bytes() != target.read_bytes():
                    raise TraceError(f"{target}: is there already, and is not trace {trace}; nothing was written over")
            finally:
                fetched.unlink(missing_ok=True)
        except OSError as error:
            raise TraceError(f"{target}: cannot be written: {error.strerror or error}") from error
        return target

    def download_csv(self, trace: str, target: Path) -> Path:
        """Time and signals as plain CSV, in s, rad and V. Raises TraceError when it cannot be written."""
        try:
            self._download(trace, "data.csv", target, lambda _transfer: None)
        except OSError as error:
            raise TraceError(f"{target}: cannot be written: {error.strerror or error}") from error
        return target

    def signals(
        self, trace: str, *, points: int = 2000, start: float | None = None, end: float | None = None
    ) -> TraceSignals:
        """Signals for a plot, thinned to about `points` between `start` and `end` (s)."""
        path = f"{self._path}/{trace}/data.json"
        return self._connection.get(TraceSignals, path, points=points, start=start, end=end)

    def upload(self, file: Path) -> CatalogueEntry:
        """Takes in a trace from elsewhere: .mcap of this project, or plain .csv. Raises TraceError for another file,
        ServiceError where the service has it already (`trace-exists`)."""
        file = Path(file)
        try:
            with file.open("rb") as stream:
                suffix = ".mcap" if stream.read(len(MCAP)) == MCAP else file.suffix.lower()
            kind = KINDS.get(suffix)
            if kind is None:
                raise TraceError(f"{file}: is no trace: {' or '.join(KINDS)} are taken")
            size = file.stat().st_size
            with file.open("rb") as stream:
                pieces = iter(lambda: stream.read(PART), b"")
                headers = {"Content-Type": kind, "Content-Length": str(size)}
                request = Request("POST", self._path, content=pieces, headers=headers, patience=UPLOAD_WITHIN)
                return self._connection.ask(CatalogueEntry, request)
        except OSError as error:
            raise TraceError(f"{file}: cannot be read: {error.strerror or error}") from error

    def upload_unless_there(self, file: Path, number: str) -> CatalogueEntry:
        """The same, for a trace whose number is known: one that the service has is not sent again."""
        return self.known(number) or self.upload(file)

    def known(self, number: str) -> CatalogueEntry | None:
        """The entry of a trace; None if the robot has none of this number."""
        try:
            return self.get(number).entry
        except ServiceError as error:
            if error.status != 404:
                raise
            return None

    def change(self, trace: str, *, tags: Sequence[str] | None = None, notes: str | None = None) -> CatalogueEntry:
        """New tags or notes; what is None stays."""
        body = TraceChange(tags=None if tags is None else tuple(tags), notes=notes)
        return self._connection.ask(CatalogueEntry, Request("PATCH", f"{self._path}/{trace}", body))

    def delete(self, trace: str) -> None:
        """Deletes a trace for good. Refused while a model or a job refers to it."""
        self._connection.do(Request("DELETE", f"{self._path}/{trace}"))

    def gains(self, trace: str) -> Sequence[MeasuredGain]:
        """The actual proportional gains that a trace shows."""
        return self._connection.get(tuple[MeasuredGain, ...], f"{self._path}/{trace}/gain")
