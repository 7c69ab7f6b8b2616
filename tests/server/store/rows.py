"""Rows that tests of several rooms put into the database."""

from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any

from daq.traces.catalogue import TraceSummary

NOW = datetime(2026, 1, 1, tzinfo=UTC)


def new_trace(number: int, **changes: Any) -> TraceSummary:
    fields: dict[str, Any] = {
        "trace_id": f"{number:012x}",
        "path": Path(f"{number}.mcap"),
        "state": "finished",
        "created": NOW + timedelta(seconds=number),
        "source": "mock",
        "kind": "ramp",
        "joints": (1, 2, 3),
        "moved": (1, 2, 3),
        "outcome": "complete",
        "samples": 10,
        "duration": 0.2,
        "size": 1000,
    }
    return TraceSummary(**(fields | changes))
