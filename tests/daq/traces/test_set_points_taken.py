"""A record of a slow line tells from which control period on the set points of each sample were used."""

from pathlib import Path

import numpy as np
import pytest
from mcap.reader import make_reader

from daq.traces import set_points_taken
from daq.traces.reader import read_trace
from daq.traces.store import write_trace
from daq.traces.writer import TraceWriter
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
