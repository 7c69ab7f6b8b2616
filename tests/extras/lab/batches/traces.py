"""A folder of short traces that an arm could have recorded, each of another number."""

from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path

from daq.contracts.machine import load_machine
from daq.traces.store import write_trace
from tests.model.simulation.records import ramp_trace

MACHINE = load_machine("ma2000")


def number(index: int) -> str:
    """The number of a trace."""
    return f"{index:012x}"


def folder_of_traces(folder: Path, count: int) -> Path:
    """Writes `count` ramps of 1 s."""
    folder.mkdir()
    for index in range(count):
        ramp = ramp_trace(MACHINE, amplitude=0.1 + 0.01 * index, duration=1.0)
        told = {"trace_id": number(index), "robot": "ma2000", "notes": f"ramp, run {index}", "outcome": "complete"}
        record = ramp.record.model_copy(update={**told, "created": datetime(2026, 11, 10 + index % 20, tzinfo=UTC)})
        write_trace(replace(ramp, record=record), folder / f"{index:03}.mcap")
    return folder
