"""The archive of a robot's traces: its state, and the state of one trace in it."""

from __future__ import annotations

from typing import Literal

from pydantic import AwareDatetime

from daq.contracts.service.base import Wire


class Transfer(Wire):
    """A transfer of a trace between this computer and the archive."""

    direction: Literal["send", "fetch"]
    state: Literal["waiting", "moving", "failed"]
    done: int
    """Bytes transferred so far."""
    total: int
    problem: str = ""
    """Why the transfer failed, or what it waits for, in one line."""


class TraceArchive(Wire):
    """Where a trace is stored, and its transfer if there is one."""

    id: str
    local: bool
    """Whether the local folder contains the trace."""
    archived: AwareDatetime | None
    """When the archived copy was read back and compared; None if it is not archived."""
    checked: AwareDatetime | None
    """When the archived copy was last read back."""
    size: int | None
    sha256: str | None
    transfer: Transfer | None


class ArchiveOrder(Wire):
    """Requests that a trace is archived now. `drop`: then delete the local copy, whatever the policy is."""

    drop: bool = False


class ArchiveStatus(Wire):
    """State of the archive."""

    place: str
    """Bucket and endpoint."""
    state: Literal["ok", "away", "refused"]
    """`refused`: the store denies access or has no such bucket; a person must act."""
    problem: str
    """Why the last attempt failed, in one line; empty if it succeeded."""
    since: AwareDatetime | None
    """Time of the first failure since the last success."""
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
    """Size of local traces (bytes) above which the oldest archived ones are deleted locally; None for no limit."""
