"""Rows that tests of several rooms put into the database."""

from datetime import UTC, datetime, timedelta

from server.store.traces import NewTrace

NOW = datetime(2026, 1, 1, tzinfo=UTC)


def new_trace(number: int, **changes: object) -> NewTrace:
    fields: dict[str, object] = {
        "id": f"{number:012x}",
        "robot": "ma2000",
        "file": f"{number}.mcap",
        "created": NOW + timedelta(seconds=number),
        "source": "mock",
        "kind": "ramp",
        "name": None,
        "joints": (1, 2, 3),
        "moved": (1, 2, 3),
        "outcome": "complete",
        "samples": 10,
        "duration": 0.2,
        "size": 1000,
        "operator": None,
        "experiment": None,
        "notes": "",
    }
    return NewTrace(**(fields | changes))  # type: ignore[arg-type]
