"""A record of a slow line tells from which control period on the set points of each sample were used."""

from pathlib import Path

import numpy as np
import pytest
from mcap.reader import make_reader

from daq.runner.recorder import Recorder
from daq.traces import set_points_taken
from daq.traces.reader import read_trace
from daq.traces.store import write_trace
from daq.traces.writer import TraceWriter
from tests.daq.quiet import Quiet
from tests.daq.traces.samples import JOINTS, record, row, write

TAKEN = (0, *range(2, 38, 4))


@pytest.fixture
def slow(tmp_path: Path) -> Path:
    """A record of every fourth period; of the first sample nothing is known."""
    path = tmp_path / "slow.mcap"
    with TraceWriter(path, record(every=4), JOINTS) as writer:
        for tick, taken in zip(range(0, 40, 4), TAKEN, strict=True):
            writer.sample(row(tick, taken=taken))
        writer.close("complete")
    return path


def test_it_reads_back_and_is_written_again(slow: Path, tmp_path: Path) -> None:
    trace = read_trace(slow)
    again = read_trace(write_trace(trace, tmp_path / "again.mcap"))
    for each in (trace, again):
        np.testing.assert_array_equal(each.taken, TAKEN)  # type: ignore[arg-type]


def test_a_record_of_a_fast_line_shows_every_set_point_itself(tmp_path: Path) -> None:
    path = write(tmp_path / "fast.mcap")
    assert read_trace(path).taken is None
    with path.open("rb") as stream:
        assert set_points_taken.TOPIC not in {channel.topic for _, channel, _ in make_reader(stream).iter_messages()}


# ---- What is missing from a trace is counted in samples, by the trace as by the recorder that makes it.


@pytest.mark.parametrize(
    ("every", "ticks", "missing"),
    [
        (1, [7], 0),
        (1, [0, 1, 4], 2),
        (3, [0, 3, 6], 0),
        (3, [0, 3, 7, 10], 0),
        (3, [0, 3, 8, 11], 1),
        (3, [0, 3, 9, 12], 1),
        (3, [0, 4, 8, 12], 1),
        (20, [0, 22, 41, 69, 81], 0),
        (20, list(range(0, 2900, 29)), 45),
        (20, [0, 10, 50], 1),
        (20, [0, 30, 50, 99], 2),
        (3, [0, 3, 4, 7, 10, 16], 1),
    ],
    ids=str,
)
def test_missing_samples(tmp_path: Path, every: int, ticks: list[int], missing: int) -> None:
    with TraceWriter(tmp_path / "a.mcap", record(every=every), JOINTS, patience=10) as writer:
        recorder = Recorder(writer, JOINTS, Quiet(), every)
        for tick in ticks:
            recorder.row(row(tick))
        path = writer.close("complete", {})
    assert (recorder.missing, read_trace(path).missing) == (missing, missing)
