"""Lists, reads, downloads, uploads and tags traces of the service."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from datetime import datetime
from pathlib import Path

from daq.client.connection import PART, Connection, Request
from daq.client.errors import ServiceError
from daq.contracts.errors import TraceError
from daq.contracts.labels import Outcome, Source
from daq.contracts.service.traces import CatalogueEntry, TraceChange, TraceDetails, TraceSignals

LAST = "last"
"""Name of the newest trace, usable in place of its ID."""
MCAP = b"\x89MCAP0\r\n"
"""First bytes of an MCAP file."""
KINDS = {".mcap": "application/octet-stream", ".csv": "text/csv"}
MOST_NAMED = 4
"""Most traces listed in the error about an ambiguous name."""
UPLOAD_WITHIN = 600.0
"""Time-out (s) for the answer to an upload."""


class Traces:
    """The service's catalogue of traces."""

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
        joint: int | None = None,
        effect: str | None = None,
    ) -> Iterator[CatalogueEntry]:
        """Yields traces, the newest first; `text` is searched in ID, file, name, kind, operator, notes and tags.
        `joint` moved; `effect` was named by the newest diagnosis that used the trace."""
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
            joint=joint,
            effect=effect,
        )

    def get(self, trace: str) -> TraceDetails:
        """Returns a trace's record, key figures and events."""
        return self._connection.get(TraceDetails, f"{self._path}/{trace}")

    def find(self, wanted: str) -> CatalogueEntry:
        """Returns the trace for `wanted`: `last`, or the beginning of an ID or file name, as on the command line.
        Raises TraceError if no trace or several match."""
        if wanted == LAST:
            newest = next((entry for entry in self.list() if not entry.missing), None)
            if newest is None:
                raise TraceError("the service has no trace yet")
            return newest
        found = [one for one in self.list(wanted[:100]) if one.id.startswith(wanted) or one.file.startswith(wanted)]
        exact = [entry for entry in found if entry.id == wanted]
        if not found:
            raise TraceError(f"trace {wanted!r}: no trace of the service has this ID or name")
        if len(found) > 1 and not exact:
            names = ", ".join(entry.file for entry in found[:MOST_NAMED])
            raise TraceError(f"trace {wanted!r}: {len(found)} of the service match: {names}; give more characters")
        return exact[0] if exact else found[0]

    def download(self, trace: str, target: Path) -> Path:
        """Downloads the recorded file to `target`; to a folder, under its own name.

        Returns the file. Raises TraceError if another file exists there, or it cannot be written.
        """
        target = Path(target)
        if target.is_dir():
            target = target / Path(self.get(trace).entry.file).name
        try:
            if not target.exists():
                self._connection.download(f"{self._path}/{trace}/data.mcap", target)
                return target
            fetched = target.with_name(f".{target.name}.fetched")
            try:
                self._connection.download(f"{self._path}/{trace}/data.mcap", fetched)
                if fetched.read_bytes() != target.read_bytes():
                    raise TraceError(f"{target}: exists and is not trace {trace}; nothing was overwritten")
            finally:
                fetched.unlink(missing_ok=True)
        except OSError as error:
            raise TraceError(f"{target}: cannot be written: {error.strerror or error}") from error
        return target

    def download_csv(self, trace: str, target: Path) -> Path:
        """Downloads time and signals as plain CSV, in s, rad and V. Raises TraceError if it cannot be written."""
        try:
            self._connection.download(f"{self._path}/{trace}/data.csv", target)
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
        """Uploads a trace: .mcap of this project, or plain .csv. Raises TraceError for another file, ServiceError if
        the service has it already (`trace-exists`)."""
        file = Path(file)
        try:
            with file.open("rb") as stream:
                suffix = ".mcap" if stream.read(len(MCAP)) == MCAP else file.suffix.lower()
            kind = KINDS.get(suffix)
            if kind is None:
                raise TraceError(f"{file}: is no trace: {' or '.join(KINDS)} are accepted")
            size = file.stat().st_size
            with file.open("rb") as stream:
                pieces = iter(lambda: stream.read(PART), b"")
                headers = {"Content-Type": kind, "Content-Length": str(size)}
                request = Request("POST", self._path, content=pieces, headers=headers, patience=UPLOAD_WITHIN)
                return self._connection.ask(CatalogueEntry, request)
        except OSError as error:
            raise TraceError(f"{file}: cannot be read: {error.strerror or error}") from error

    def upload_unless_there(self, file: Path, number: str) -> CatalogueEntry:
        """Uploads a trace with a known ID, unless the service has it already."""
        return self.known(number) or self.upload(file)

    def known(self, number: str) -> CatalogueEntry | None:
        """Returns the entry of a trace; None if the robot has none with this ID."""
        try:
            return self.get(number).entry
        except ServiceError as error:
            if error.status != 404:
                raise
            return None

    def change(self, trace: str, *, tags: Sequence[str] | None = None, notes: str | None = None) -> CatalogueEntry:
        """Changes tags or notes; a value of None stays unchanged."""
        body = TraceChange(tags=None if tags is None else tuple(tags), notes=notes)
        return self._connection.ask(CatalogueEntry, Request("PATCH", f"{self._path}/{trace}", body))

    def delete(self, trace: str) -> None:
        """Deletes a trace permanently. Refused while a model or a job refers to it."""
        self._connection.do(Request("DELETE", f"{self._path}/{trace}"))
