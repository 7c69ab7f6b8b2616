"""Traces after kill -9 and power cuts at random moments of recordings in real time: what is salvaged, what is gone.

    python -m benchmarks salvage

A recorder takes a sample every 20 ms and reports each one that it has handed over, and the length of the file after
each sync. A kill leaves the file as the operating system has it. A power cut is a kill after which the file is cut to
its length at the last sync, and a random tail put behind it: nothing, zeros, noise, or the bytes that were there.
"""

from __future__ import annotations

import argparse
import multiprocessing
import os
import random
import signal
import sys
import tempfile
import time
from collections import Counter
from dataclasses import dataclass
from datetime import UTC, datetime
from multiprocessing.context import ForkProcess
from pathlib import Path
from typing import IO

import numpy as np

from benchmarks.figures import Figure, at_least, at_most, quantile, show
from daq.contracts.sample import SampleRow
from daq.contracts.trace import TraceRecord
from daq.traces import disk
from daq.traces.naming import new_trace_id, part_path
from daq.traces.reader import read_trace
from daq.traces.salvage import salvage
from daq.traces.writer import TraceWriter

PERIOD = 0.02
LOSS_S = 1.2
AT_ONCE = 10
LONGEST_S = 4.0
"""Latest moment (s) of a random kill after the first sample."""
READY = b"r\n"
ENDING_TICKS = 60
"""Length of the recordings that are killed around their end."""


@dataclass(frozen=True)
class Case:
    """One recording: how it ends, and when (s after it began)."""

    way: str
    after: float
    seed: int


@dataclass(frozen=True)
class Result:
    """What was left: `lost` in s; None when the recorder had finished the trace itself before it was killed."""

    way: str
    outcome: str
    lost: float | None
    wrong: bool


def row(tick: int) -> SampleRow:
    """A row that can be told from every other."""
    values = (tick * 0.001, tick * 0.002, tick * 0.003)
    return SampleRow(tick, tick * PERIOD, time.monotonic(), values, values, (0.0, 0.0, 0.0), values, (tick, 0, 0))


def record_in_real_time(path: Path, report: int, last_tick: int | None) -> None:
    """Records until it is killed, or closes after `last_tick`. Reports `t TICK` and `s LENGTH`, one a line."""
    sync = disk.sync

    def reported_sync(stream: IO[bytes]) -> None:
        sync(stream)
        os.write(report, f"s {os.fstat(stream.fileno()).st_size}\n".encode())

    record = TraceRecord(trace_id=new_trace_id(), created=datetime.now(UTC), software="benchmark", source="mock")
    writer = TraceWriter(path, record, (1, 2, 3))
    disk.sync = reported_sync
    os.write(report, READY + f"s {writer.part.stat().st_size}\n".encode())
    begun = time.monotonic()
    tick = 0
    while last_tick is None or tick < last_tick:
        time.sleep(max(0.0, begun + tick * PERIOD - time.monotonic()))
        writer.sample(row(tick))
        os.write(report, f"t {tick}\n".encode())
        tick += 1
    writer.close("complete")


def start(path: Path, case: Case) -> tuple[ForkProcess, int]:
    """A recorder in a process of its own, and where it reports."""
    reading, writing = os.pipe()
    last_tick = ENDING_TICKS if case.way == "around the end" else None
    process = multiprocessing.get_context("fork").Process(target=record_in_real_time, args=(path, writing, last_tick))
    process.start()
    os.close(writing)
    if os.read(reading, len(READY)) != READY:
        raise RuntimeError("the recorder ended before it began")
    return process, reading


def ended(path: Path, case: Case, process: ForkProcess, reading: int) -> Result:
    """Kills the recorder, does to its file what the case wants, salvages it and compares."""
    if process.pid is not None and process.is_alive():
        os.kill(process.pid, signal.SIGKILL)
    process.join()
    with os.fdopen(reading) as stream:
        lines = [line.split() for line in stream.read().splitlines()]
    handed = max((int(value) for kind, value in lines if kind == "t"), default=-1)
    part = part_path(path)
    if path.exists():
        trace = read_trace(path)
        whole = case.way == "around the end" and len(trace) == ENDING_TICKS
        return Result(case.way, f"ended itself: {trace.record.outcome}", None, not whole)
    if case.way == "power cut":
        cut(part, max(int(value) for kind, value in lines if kind == "s"), random.Random(case.seed))
    salvaged = salvage(part)
    trace = read_trace(path)
    expected = np.arange(salvaged.samples)
    right = np.array_equal(trace.time, expected * PERIOD) and np.array_equal(trace.position[:, 1], expected * 0.002)
    lost = (handed + 1 - salvaged.samples) * PERIOD
    return Result(case.way, str(trace.record.outcome), max(0.0, lost), not right)


def cut(part: Path, synced: int, rng: random.Random) -> None:
    """The file as a power cut may leave it: what was synced, and behind it anything."""
    data = part.read_bytes()
    tails = (b"", bytes(rng.randrange(8192)), rng.randbytes(rng.randrange(8192)), data[synced:])
    tail = rng.choice(tails)
    part.write_bytes(data[:synced] + tail[: rng.randrange(len(tail) + 1)])


def campaign(cases: list[Case], folder: Path) -> list[Result]:
    """Runs the cases, some at a time."""
    results = []
    for first in range(0, len(cases), AT_ONCE):
        running = []
        for number, case in enumerate(cases[first : first + AT_ONCE], start=first):
            path = folder / f"{number}.mcap"
            process, reading = start(path, case)
            running.append((time.monotonic() + case.after, path, case, process, reading))
        for moment, path, case, process, reading in sorted(running, key=lambda entry: entry[0]):
            time.sleep(max(0.0, moment - time.monotonic()))
            results.append(ended(path, case, process, reading))
    return results


def figures(way: str, results: list[Result]) -> list[Figure]:
    """What one way of ending did to its recordings."""
    mine = [result for result in results if result.way == way]
    lost = [result.lost for result in mine if result.lost is not None]
    outcomes = ", ".join(f"{count} {outcome}" for outcome, count in sorted(Counter(r.outcome for r in mine).items()))
    right = sum(not result.wrong for result in mine)
    claimed = sum(result.outcome == "complete" for result in mine)
    return [
        at_least(f"{way}: traces whole up to the loss", right, len(mine), f"of {len(mine)}", outcomes),
        at_most(f"{way}: unfinished runs claimed complete", claimed, 0, ""),
        at_most(
            f"{way}: longest loss",
            max(lost, default=0.0),
            LOSS_S,
            "s",
            f"median {quantile(lost, 0.5):.2f} s" if lost else "",
        ),
    ]


def main() -> int:
    """The exit code: 1 when a target was missed."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks salvage", description=__doc__)
    parser.add_argument("--moments", type=int, default=200, help="of each way to end (default 200)")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--quick", action="store_true", help="ten moments of each")
    given = parser.parse_args()
    rng = random.Random(given.seed)
    moments = 10 if given.quick else given.moments
    cases = [
        Case(way, rng.uniform(0.1, LONGEST_S), rng.randrange(1 << 30))
        for way in ("kill", "power cut")
        for _ in range(moments)
    ]
    end = ENDING_TICKS * PERIOD
    cases += [Case("around the end", rng.uniform(end - 0.04, end + 0.02), 0) for _ in range(max(10, moments // 4))]
    with tempfile.TemporaryDirectory() as folder:
        results = campaign(cases, Path(folder))
    found = [figure for way in ("kill", "power cut", "around the end") for figure in figures(way, results)]
    return show("Traces after kills and power cuts", "python -m benchmarks salvage", found)


if __name__ == "__main__":
    sys.exit(main())
