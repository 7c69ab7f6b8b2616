"""The archive of a robot's traces: its state, and what it has of one trace."""

from __future__ import annotations

from typing import Literal

from pydantic import AwareDatetime

from daq.contracts.service.base import Wire


class Transfer(Wire):
    """A trace on its way between this computer and the archive."""

    direction: Literal["send", "fetch"]
    state: Literal["waiting", "moving", "failed"]
    done: int
    """Number of bytes moved so far."""
    total: int
    problem: str = ""
    """Why it failed, or what it waits for, in one line."""


class TraceArchive(Wire):
    """Where a trace is, and how far it is on its way."""

    id: str
    local: bool
    """Whether the folder of traces has it."""
    archived: AwareDatetime | None
    """When the archive had it, read back and compared; None before that."""
    checked: AwareDatetime | None
    """When it was last read back."""
    size: int | None
    sha256: str | None
    transfer: Transfer | None


class ArchiveOrder(Wire):
    """Asks for a trace to be archived now. `drop`: the local copy goes when that is done, whatever the policy says."""

    drop: bool = False


class ArchiveStatus(Wire):
    """State of the archive."""

    place: str
    """Bucket and address."""
    state: Literal["ok", "away", "refused"]
    """`refused`: the store refuses the service, or has no such bucket, so that a person must look."""
    problem: str
    """Why the last attempt failed, in one line; empty if it did not."""
    since: AwareDatetime | None
    """Since when it fails."""
    next_try: float | None
    """Time (s) until the next attempt."""
    archived: int
    """Number of traces in the archive."""
    waiting: int
    """Number of traces that wait to be sent."""
    fetching: int
    """Number of traces that wait to be fetched, or are being fetched."""
    local_bytes: int
    """Total size of the local traces."""
    local_limit: int | None
    """Size of local traces (bytes) beyond which the oldest archived ones go; None if there is no limit."""
