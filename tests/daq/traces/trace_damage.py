"""Trace files damaged at random and in every length field, then read, verified, listed and salvaged.

Nothing may end in another error than TraceError; every sample that is delivered is one of the original's, in its order;
no file is called complete, or trustworthy, of which anything is missing or different; no unread byte of a part file is
deleted.
"""

import itertools
import random
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from typing import Any

import numpy as np

from daq.contracts.errors import TraceError
from daq.contracts.trace import Trace
from daq.traces.catalogue import list_traces
from daq.traces.layout import ALL_SIGNALS
from daq.traces.reader import read_trace
from daq.traces.salvage import salvage_folder
from daq.traces.verify import verify
from tests.daq.traces.damaged_traces import (
    Choice,
    Damaged,
    Original,
    Tally,
    at_boundaries,
    at_random,
    inside_chunks,
    of_records,
    originals,
)

CASES = 22_000


def differs(trace: Trace, original: Trace) -> str | None:
    """What of the original is missing or different; None when everything is there."""
    for name in ALL_SIGNALS:
        there, expected = getattr(trace, name), getattr(original, name)
        if (there is None) != (expected is None) or not np.array_equal(there, expected):
            return name
    if trace.record != original.record.model_copy(
        update={"outcome": trace.record.outcome, "counters": trace.record.counters}
    ):
        return "record"
    return None if (trace.joints, trace.events) == (original.joints, original.events) else "joints or events"


def wrong_samples(trace: Trace, original: Trace) -> int:
    """Samples that are none of the original's, or out of its order."""
    joints = [original.joints.index(joint) if joint in original.joints else -1 for joint in trace.joints]
    if -1 in joints or len(trace) == 0:
        return len(trace)
    rows = np.searchsorted(original.time, trace.time)
    rows[rows == len(original)] = 0
    wrong = original.time[rows] != trace.time
    wrong[1:] |= np.diff(rows) <= 0
    for name in ALL_SIGNALS:
        there, expected = getattr(trace, name), getattr(original, name)
        if there is not None and expected is not None:
            expected = expected[rows] if expected.ndim == 1 else expected[rows][:, joints]
            wrong |= (there != expected).reshape(len(trace), -1).any(axis=1)
    return int(wrong.sum())


class Campaign:
    """Damages of some originals, in a folder of its own."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.tally = Tally()
        self.originals = originals()
        self._sound = {one.kind: self._read_whole(one) for one in self.originals}

    def _read_whole(self, original: Original) -> Trace:
        path = self.folder / f"sound{original.suffix}"
        path.write_bytes(original.data)
        trace = read_trace(path)
        path.unlink()
        return trace

    def run(self, cases: Iterable[Damaged]) -> Tally:
        """One case after the other."""
        for damaged in cases:
            self._case(damaged)
            self.tally.cases += 1
        return self.tally

    def _case(self, damaged: Damaged) -> None:
        path = self.folder / f"a{damaged.original.suffix}"
        path.write_bytes(damaged.data)
        self._guarded(damaged, lambda: verify(path) and None)
        self._judge(damaged, path, self._guarded(damaged, lambda: read_trace(path)))
        self._guarded(damaged, lambda: list_traces(self.folder) and None)
        if path.suffix == ".part":
            self._guarded(damaged, lambda: salvage_folder(self.folder) and None)
            self._salvaged(damaged)
        for left in self.folder.iterdir():
            left.unlink()

    def _guarded(self, damaged: Damaged, action: Callable[[], Any]) -> Any:
        try:
            return action()
        except TraceError as error:
            if "\n" in str(error):
                self.tally.fault("errors of several lines", str(damaged), str(error))
            self.tally.ends["refused"] += 1
            return None
        except Exception as error:  # noqa: BLE001  # that is what is counted
            self.tally.fault("other exceptions", str(damaged), repr(error))
            return None

    def _judge(self, damaged: Damaged, path: Path, trace: Trace | None) -> None:
        if trace is None:
            return
        original = self._sound[damaged.original.kind]
        if wrong := wrong_samples(trace, original):
            self.tally.fault("wrong samples", str(damaged), f"{wrong} of {len(trace)}")
        different = differs(trace, original)
        self.tally.ends["read, the same" if different is None else "read, less"] += 1
        if trace.record.outcome == "complete" and (different or path.suffix == ".part"):
            self.tally.fault("called complete", str(damaged), str(different))
        finished = damaged.original.suffix == ".mcap"
        if finished and different and verify(path).trustworthy:
            self.tally.fault("called trustworthy", str(damaged), different)

    def _salvaged(self, damaged: Damaged) -> None:
        made = self.folder / "a.mcap"
        kept = [one for one in self.folder.iterdir() if one.read_bytes() == damaged.data]
        if not made.exists():
            self.tally.ends["put aside"] += 1
            if [one.name for one in kept] != ["a.mcap.part.unreadable"]:
                self.tally.fault("part files lost or left", str(damaged), str(sorted(self.folder.iterdir())))
            return
        self.tally.ends["salvaged"] += 1
        trace = self._guarded(damaged, lambda: read_trace(made))
        self._judge(damaged, made, trace)
        if trace is None or trace.record.outcome != "interrupted":
            self.tally.fault("salvaged traces that are none", str(damaged), str(made))


def on_purpose(sound: list[Original], chosen: Choice) -> Iterator[Damaged]:
    """Every length field of every record at its boundaries, every record left out, doubled, emptied, swapped."""
    for original in sound:
        for damages in (at_boundaries, of_records, inside_chunks):
            yield from damages(original, chosen)


def campaign(cases: int, seed: int, folder: Path, share: float = 1.0) -> Tally:
    """All damage on purpose, or a share of it at random, and damage at random up to `cases`."""
    rng = random.Random(seed)
    running = Campaign(folder)
    running.run(on_purpose(running.originals, lambda: rng.random() < share))
    left = max(0, cases - running.tally.cases)
    return running.run(itertools.islice(at_random(running.originals, rng), left))
