"""Checks for disk space before anything moves."""

from __future__ import annotations

import shutil
import tempfile
from pathlib import Path

from daq.contracts.errors import TraceError
from daq.traces import disk

BYTES_A_SAMPLE = 400
"""Size (bytes) of one joint's sample, estimated generously (docs/traces.md gives the measured size)."""
RESERVE = 20_000_000
"""Space (bytes) left free for other programs."""


def require_room(folder: Path, samples: int, joints: int) -> None:
    """Makes the folder, writes and syncs a test file, and compares the free space with the need of the trace.

    Raises a one-line TraceError.
    """
    needed = samples * joints * BYTES_A_SAMPLE + RESERVE
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder) as stream:
            stream.write(b"room for a trace?")
            disk.sync(stream)
        free = shutil.disk_usage(folder).free
    except OSError as error:
        raise TraceError(f"{folder}: traces cannot be written there: {disk.reason(error)}") from error
    if free < needed:
        raise TraceError(f"{folder}: {free / 1e6:.0f} MB are free, this trace may need {needed / 1e6:.0f} MB")
