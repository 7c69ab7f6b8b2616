"""Names of trace files: date and time, kind of experiment, first digits of the trace's ID."""

from __future__ import annotations

import hashlib
import re
import secrets
from datetime import UTC
from pathlib import Path

from daq.contracts.trace import TraceRecord
from daq.traces.layout import PART_SUFFIX, SUFFIX

ID_DIGITS = 12
DIGITS_IN_NAME = 6
KIND_LENGTH = 40


def new_trace_id() -> str:
    """Returns twelve random hexadecimal digits."""
    return secrets.token_hex(ID_DIGITS // 2)


def trace_id_of(*contents: bytes) -> str:
    """Returns twelve hexadecimal digits that depend only on the contents of files, not on their paths."""
    digest = hashlib.sha256()
    for content in contents:
        digest.update(len(content).to_bytes(8, "big") + content)
    return digest.hexdigest()[:ID_DIGITS]


def trace_path(folder: Path, record: TraceRecord) -> Path:
    """Path of a trace, as `2026-11-21T05-14-42Z_ramp_ab12cd.mcap`: the order by name is the order in time."""
    moment = record.created.astimezone(UTC).strftime("%Y-%m-%dT%H-%M-%SZ")
    kind: str = record.source
    if record.spec is not None:
        kind = record.spec.name or record.spec.trajectory.kind
    kind = re.sub(r"[^A-Za-z0-9.-]+", "-", kind)[:KIND_LENGTH]
    return folder / f"{moment}_{kind}_{record.trace_id[:DIGITS_IN_NAME]}{SUFFIX}"


def part_path(path: Path) -> Path:
    """Name of a trace during recording."""
    return path.with_name(path.name + PART_SUFFIX.removeprefix(SUFFIX))


def finished_path(part: Path) -> Path:
    """Final name of a part file."""
    return part.with_name(part.name.removesuffix(PART_SUFFIX) + SUFFIX)
