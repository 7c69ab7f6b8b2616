"""A trace is in the format of ROS 2, and one of the format before it is still read, salvaged and written again."""

import shutil
from pathlib import Path

import numpy as np
import pytest
from mcap.reader import make_reader

from daq.contracts.trace import TRACE_FORMAT, TraceEvent
from daq.traces.catalogue import list_traces
from daq.traces.naming import part_path
from daq.traces.plot import plot_trace
from daq.traces.reader import read_trace
from daq.traces.salvage import salvage
from daq.traces.store import write_trace
from daq.traces.verify import verify
from tests.daq.traces.samples import row, write

FORMAT_1 = Path(__file__).with_name("format_1.mcap")
"""A trace that version 0.1.0 recorded: 40 rows of the tests' samples, two events."""
EVENTS = (
    TraceEvent(time=0.0, kind="start", message="recording starts", tick=0),
    TraceEvent(time=0.5, kind="limit", message="joint 2: 21.6° reached", tick=25, joint=2),
)


def profile(path: Path) -> str:
    with path.open("rb") as stream:
        return make_reader(stream).get_header().profile


def test_a_trace_of_format_1_is_read_with_its_events() -> None:
    trace = read_trace(FORMAT_1)
    assert (trace.record.format, trace.record.outcome, trace.record.counters["retries"]) == (1, "complete", 3)
    np.testing.assert_array_equal(trace.position, [row(tick).position for tick in range(40)])
    assert trace.events == EVENTS
    assert verify(FORMAT_1).trustworthy


def test_a_trace_of_format_1_is_drawn_listed_and_shown_in_a_notebook(tmp_path: Path) -> None:
    shutil.copy(FORMAT_1, tmp_path / "old.mcap")
    trace = read_trace(tmp_path / "old.mcap")
    assert plot_trace(trace, tmp_path / "old.svg").stat().st_size > 10_000
    (listed,) = list_traces(tmp_path)
    assert (listed.state, listed.samples, listed.outcome) == ("finished", 40, "complete")
    assert "40 samples, 0 missing, complete" in trace._repr_html_()


def test_a_trace_of_format_1_is_written_again_in_the_format_of_today(tmp_path: Path) -> None:
    old = read_trace(FORMAT_1)
    new = read_trace(write_trace(old, tmp_path / "new.mcap"))
    assert new.record == old.record.model_copy(update={"format": TRACE_FORMAT})
    assert new.events == old.events
    np.testing.assert_array_equal(new.position, old.position)


@pytest.mark.parametrize(("old", "expected"), [(True, ""), (False, "ros2")])
def test_a_salvaged_trace_keeps_its_format_and_says_so_only_of_ros_2_messages(
    tmp_path: Path, old: bool, expected: str
) -> None:
    path = tmp_path / "a.mcap"
    whole = shutil.copy(FORMAT_1, tmp_path / "whole.mcap") if old else write(tmp_path / "whole.mcap", 40)
    before = read_trace(whole)
    part_path(path).write_bytes(whole.read_bytes()[:-2000])
    assert salvage(part_path(path)).path == path
    after = read_trace(path)
    assert profile(path) == profile(whole) == expected
    assert after.record.format == before.record.format
    assert after.events == before.events
    np.testing.assert_array_equal(after.position, before.position)
    assert after.record.outcome == "interrupted"
