"""Measures traces: the size of an hour, the cost of recording, and the time of opening into numpy, first and again.

python -m benchmarks trace_open
"""

from __future__ import annotations

import argparse
import sys
import tempfile
import time
from datetime import UTC, datetime
from pathlib import Path

import numpy as np
from mcap.stream_reader import StreamReader

from benchmarks.figures import Figure, at_most, show
from daq.contracts.machine import load_machine
from daq.contracts.sample import SampleRow
from daq.contracts.trace import TraceRecord
from daq.traces import cache
from daq.traces.layout import RECORDED_SIGNALS
from daq.traces.naming import new_trace_id
from daq.traces.reader import read_trace
from daq.traces.recording import Recording
from daq.traces.writer import SYNC_INTERVAL

RATE = 50
"""Sampling rate (Hz)."""
FIRST_S, AGAIN_S = 6.0, 0.2
ROWS_A_SYNC = round(RATE * SYNC_INTERVAL)
"""Rows in one chunk, as in a recording in real time."""


def rows(minutes: float, joints: int) -> list[SampleRow]:
    """Returns sines with the noise and the rounding of a 12-bit sensor, a few degrees behind their set points."""
    rng = np.random.default_rng(1)
    count = round(minutes * 60 * RATE)
    time_s = np.arange(count)[:, None] / RATE
    adc_count, posture_unit = 4.71 / 4096, 4.71 / 1000
    angle = 2.0 + 0.4 * np.sin(2.1 * time_s + np.arange(joints))
    position = np.round((angle + rng.normal(0, 0.002, angle.shape)) / adc_count) * adc_count
    set_point = np.round((2.0 + 0.4 * np.sin(2.1 * time_s + np.arange(joints) + 0.1)) / posture_unit) * posture_unit
    error = set_point - position
    power = np.clip(np.round(2 * error / adc_count), -127, 127).astype(int)
    arrival = 1000.0 + time_s[:, 0] + np.abs(rng.normal(0, 0.0004, count))
    columns = (set_point, position, error, power * 0.28, power)
    return [
        SampleRow(tick, tick / RATE, at, tuple(s), tuple(p), tuple(e), tuple(d), tuple(w))
        for tick, (at, s, p, e, d, w) in enumerate(zip(arrival.tolist(), *(c.tolist() for c in columns), strict=True))
    ]


def measure(folder: Path, minutes: float, joints: int) -> list[Figure]:
    """Records, opens, opens again."""
    samples = rows(minutes, joints)
    path = folder / f"{joints}.mcap"
    record = TraceRecord(
        trace_id=new_trace_id(),
        created=datetime.now(UTC),
        software="benchmark",
        source="mock",
        machine=load_machine("ma2000"),
        period=1 / RATE,
        drive_unit="V",
    )
    before = time.process_time()
    with path.open("xb") as stream:
        recording = Recording(stream, record, tuple(range(1, joints + 1)), RECORDED_SIGNALS, {})
        for row in samples:
            recording.row(row)
            if row.tick % ROWS_A_SYNC == 0:
                recording.flush()
        recording.finish("complete", {})
    cost_us = (time.process_time() - before) / len(samples) * 1e6
    first = timed(path)
    again = min(timed(path) for _ in range(5))
    begun = time.perf_counter()
    with path.open("rb") as stream:
        records = sum(1 for _ in StreamReader(stream).records)
    rival = f"mcap's StreamReader, {records} records undecoded: {time.perf_counter() - begun:.1f} s"
    what = f"{minutes:g} min of {joints} joints at {RATE} Hz"
    size, kept = path.stat().st_size / 1e6, cache.cache_path(path).stat().st_size / 1e6
    return [
        Figure(f"{what}: size", f"{size:.1f} MB", beside=f"its cache: {kept:.1f} MB"),
        Figure(f"{what}: recording, CPU a row", f"{cost_us:.0f} µs", beside=f"{cost_us * RATE / 1e4:.2f} % of a core"),
        at_most(f"{what}: first opening", first, FIRST_S, "s", rival),
        at_most(f"{what}: opening again", again, AGAIN_S, "s", "from the cache, checksum of the whole file included"),
    ]


def timed(path: Path) -> float:
    """Returns the time (s) of one opening; the page cache is warm, as after the recording."""
    begun = time.perf_counter()
    read_trace(path)
    return time.perf_counter() - begun


def main() -> int:
    """Returns the exit code: 1 when a target was missed."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks trace_open", description=__doc__)
    parser.add_argument("--minutes", type=float, default=60.0)
    parser.add_argument("--quick", action="store_true", help="six minutes")
    given = parser.parse_args()
    minutes = 6.0 if given.quick else given.minutes
    with tempfile.TemporaryDirectory() as folder:
        figures = [figure for joints in (3, 6) for figure in measure(Path(folder), minutes, joints)]
    return show("Traces", "python -m benchmarks trace_open", figures)


if __name__ == "__main__":
    sys.exit(main())
