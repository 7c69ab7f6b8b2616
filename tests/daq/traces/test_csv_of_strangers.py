"""Any CSV is either refused in one line, or becomes a trace that is written and read back."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from daq.contracts.errors import TraceError
from daq.traces.csv_table import import_csv
from daq.traces.reader import read_trace
from daq.traces.store import write_trace
from daq.traces.summary import joint_figures

NUMBERS = (
    "0",
    "-0.0",
    "1",
    "1e-320",
    "1e308",
    "-1e308",
    "nan",
    "inf",
    "1e9",
    "-1e9",
    "4e9",
    "0x1",
    "",
    "1_0",
    "１",
    "\0",
)
cell = st.sampled_from(NUMBERS) | st.floats().map(repr) | st.text(max_size=5)
header = st.sampled_from(["time,position_1", "time,velocity_2,drive_2", "time,position_6,set_point_6", "time", "a,b"])


@st.composite
def tables(draw: st.DrawFn) -> str:
    """A header, and rows of whatever; often with times that increase."""
    first = draw(header)
    rows = draw(st.lists(st.lists(cell, min_size=1, max_size=3), max_size=5))
    if draw(st.booleans()):
        rows = [[str(number), *row[1:]] for number, row in enumerate(rows)]
    return "\n".join([first, *(",".join(row) for row in rows)])


def refusal(path: Path) -> str:
    """What is said when a CSV is imported and written as `rig.mcap` beside it; nothing when it is taken."""
    try:
        write_trace(import_csv(path), path.with_name("rig.mcap"))
    except TraceError as error:
        return str(error)
    return ""


@settings(max_examples=30, deadline=None)
@given(tables() | st.text(max_size=60))
@example("time,velocity_1\n0,1e6\n4e9,1e6")
@example("time,position_1\n-4e9,1\n0,1")
@example("time,position_1\n")
@example('time,position_1\n0,"1\n')
def test_a_csv_is_refused_in_one_line_or_is_a_trace(tmp_path_factory: pytest.TempPathFactory, text: str) -> None:
    folder = tmp_path_factory.mktemp("csv")
    path = folder / "rig.csv"
    path.write_bytes(text.encode("utf-8", "surrogatepass"))
    refused = refusal(path)
    assert len(refused.splitlines()) <= 1
    if refused:
        assert not list(folder.glob("*.mcap*"))
        return
    trace, back = import_csv(path), read_trace(folder / "rig.mcap")
    np.testing.assert_array_equal(back.time, trace.time)
    np.testing.assert_array_equal(back.position, trace.position)
    assert len(joint_figures(back)) == (1 if len(back) else 0)


@settings(max_examples=30, deadline=None)
@given(st.binary(max_size=200))
def test_bytes_that_are_no_csv_are_refused_in_one_line(tmp_path_factory: pytest.TempPathFactory, data: bytes) -> None:
    path = tmp_path_factory.mktemp("csv") / "rig.csv"
    path.write_bytes(b"time,position_1\n" + data)
    assert len(refusal(path).splitlines()) <= 1
