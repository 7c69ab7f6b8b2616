"""Traces: search, look into, download, upload, tag."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from datetime import datetime
from pathlib import Path

from daq.client.connection import PART, Connection, Request
from daq.client.errors import ServiceError
from daq.contracts.errors import TraceError
from daq.contracts.labels import Outcome, Source
from daq.contracts.service.teaching import MeasuredGain
from daq.contracts.service.traces import CatalogueEntry, TraceChange, TraceDetails, TraceSignals

LAST = "last"
"""Name of the newest trace, in place of its number."""
KINDS = {".mcap": "application/octet-stream", ".csv": "text/csv"}
MOST_NAMED = 4
"""Number of traces named in the error about an ambiguous beginning."""
UPLOAD_WITHIN = 600.0
"""Time-out (s) for the answer to an upload."""


class Traces:
    """The service's catalogue."""

    def __init__(self, connection: Connection, robot: str) -> None:
        self._connection = connection
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

    def download(self, trace: str, target: Path) -> Path:
        """The file as it was recorded: to `target`, or under its own name where that is a folder.

        Returns the file. Raises TraceError when another one is there, or it cannot be written.
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
                    raise TraceError(f"{target}: is there already, and is not trace {trace}; nothing was written over")
            finally:
                fetched.unlink(missing_ok=True)
        except OSError as error:
            raise TraceError(f"{target}: cannot be written: {error.strerror or error}") from error
        return target

    def download_csv(self, trace: str, target: Path) -> Path:
        """Time and signals as plain CSV, in s, rad and V. Raises TraceError when it cannot be written."""
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
        """Takes in a trace from elsewhere: .mcap of this project, or plain .csv. Raises TraceError for another file,
        ServiceError where the service has it already (`trace-exists`)."""
        file = Path(file)
        kind = KINDS.get(file.suffix)
        if kind is None:
            raise TraceError(f"{file}: is no trace: {' or '.join(KINDS)} are taken")
        try:
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
        try:
            return self.get(number).entry
        except ServiceError as error:
            if error.status != 404:
                raise
        return self.upload(file)

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
