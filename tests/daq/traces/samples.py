"""Rows, records and traces made for tests; and a program that records until it is killed."""

import math
from datetime import UTC, datetime
from pathlib import Path

from daq.contracts.experiment import ExperimentSpec
from daq.contracts.machine import load_machine
from daq.contracts.sample import SampleRow
from daq.contracts.trace import TraceEvent, TraceRecord
from daq.traces.writer import TraceWriter

CREATED = datetime(2026, 11, 21, 5, 14, 42, 123456, tzinfo=UTC)
PERIOD = 0.02
JOINTS = (1, 2, 3)


def record(**changes: object) -> TraceRecord:
    """The record of a ramp on the mock."""
    fields: dict[str, object] = {
        "trace_id": "ab12cd34ef56",
        "created": CREATED,
        "software": "ma2000-daq/test",
        "source": "mock",
        "machine": load_machine("ma2000"),
        "spec": ExperimentSpec(),
        "period": PERIOD,
        "drive_unit": "V",
        "gains": {1: (2, 0, 0)},
    }
    return TraceRecord.model_validate(fields | changes)


def row(tick: int, joints: int = 3, /, **changes: object) -> SampleRow:
    """A plausible row: the error is set point − position, the drive proportional to it."""
    position = tuple(2.0 + 0.3 * math.sin(0.1 * tick + joint) for joint in range(joints))
    set_point = tuple(value + 0.01 * (joint + 1) for joint, value in enumerate(position))
    error = tuple(a - b for a, b in zip(set_point, position, strict=True))
    fields: dict[str, object] = {
        "tick": tick,
        "time": tick * PERIOD,
        "host_time": 5000.0 + tick * PERIOD + 0.0003 * (tick % 3),
        "set_point": set_point,
        "position": position,
        "error": error,
        "drive": tuple(400 * value for value in error),
        "power_raw": tuple(round(1000 * value) for value in error),
        "status": tick % 8,
    }
    return SampleRow(**(fields | changes))  # type: ignore[arg-type]


def write(path: Path, samples: int = 100, **changes: object) -> Path:
    """A finished trace of `samples` rows and two events."""
    with TraceWriter(path, record(**changes), JOINTS, patience=10) as writer:
        writer.event(TraceEvent(time=0.0, kind="start", message="recording starts", tick=0))
        for tick in range(samples):
            writer.sample(row(tick))
        writer.event(TraceEvent(time=samples * PERIOD, kind="end", message="done: 21.6° reached"))
        return writer.close("complete", {"missing_samples": 0, "retries": 3})
