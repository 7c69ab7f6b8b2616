"""What opens a file of any kind: its content decides, whatever it is called, and every joint comes along."""

from pathlib import Path

import pytest

from daq.contracts.errors import TraceError
from daq.contracts.trace import Trace
from daq.contracts.trace_limits import TraceLimits
from daq.traces.csv_table import import_csv
from daq.traces.files import open_trace
from daq.traces.kinds import kind_of
from daq.traces.reader import read_trace
from daq.traces.store import write_trace
from daq.traces.verify import verify
from tests.daq.traces.samples import write

SEVEN = ",".join(["time", *(f"position_{joint}" for joint in range(1, 8))])


def csv(path: Path, *rows: str, head: str = "time,position_1") -> Path:
    path.write_text("".join(f"{row}\n" for row in (head, *rows)))
    return path


def test_a_files_content_says_what_it_is(tmp_path: Path) -> None:
    table, trace = csv(tmp_path / "RIG.CSV", "0,1", "0.1,2"), write(tmp_path / "a.mcap", 3)
    renamed = trace.rename(tmp_path / "TRACE.dat")
    assert [kind_of(path) for path in (table, renamed)] == ["csv", "trace"]
    assert (len(open_trace(table)), len(open_trace(renamed))) == (2, 3)
    found = verify(table)
    assert found.trustworthy
    assert [finding.message[:6] for finding in found.findings] == ["is CSV", "sample"]


def test_an_arm_of_seven_joints_is_written_and_read(tmp_path: Path) -> None:
    row = "1,2,3,4,5,6,7"
    trace = import_csv(csv(tmp_path / "panda.csv", f"0,{row}", f"0.1,{row}", head=SEVEN))
    path = write_trace(trace, tmp_path / "panda.mcap")
    assert read_trace(path).joints == tuple(range(1, 8))
    with pytest.raises(TraceError, match=r"not 1 to 6 different numbers of joints \(traces\.limits\.joints\)"):
        write_trace(trace, tmp_path / "b.mcap", TraceLimits(joints=6))
    assert sorted(path.name for path in tmp_path.iterdir()) == ["panda.csv", "panda.mcap"]  # nothing unreadable is kept


def test_traces_are_equal_when_they_say_the_same(tmp_path: Path) -> None:
    path = write(tmp_path / "a.mcap", 5)
    one, other = read_trace(path), read_trace(path)
    assert one == other
    assert len({one, other}) == 1
    moved = Trace(one.record, one.joints, one.time, one.position + 1e-9)
    assert one != moved
    assert one != "trace"


def test_without_ticks_nothing_is_said_to_be_missing(tmp_path: Path) -> None:
    trace = import_csv(csv(tmp_path / "a.csv", "0,1", "0.01,1", "0.02,1", "20.02,1"))
    line = "usually 0.01 s apart, at most 20 s (after 0.02 s)"
    assert trace.missing_text.startswith(line)
    assert line in trace._repr_html_()


@pytest.mark.parametrize(
    ("data", "rows", "said"),
    [
        (b"0,1.25\n0.1,1.2", 1, "its last row has no line end"),
        (b"0,1.25\n0.1,1.25\n" + bytes(100_000), 2, "its last 100000 bytes are zeros"),
        (b"0,1.25\r\n0.1,1.25\r\n", 2, ""),
    ],
)
def test_the_end_of_a_table_that_was_cut_off_is_told(tmp_path: Path, data: bytes, rows: int, said: str) -> None:
    (tmp_path / "a.csv").write_bytes(b"time,position_1\n" + data)
    trace = import_csv(tmp_path / "a.csv")
    assert (len(trace), said in trace.record.notes, "INCOMPLETE" in trace.record.notes) == (rows, True, bool(said))
    assert trace.record.outcome == ("interrupted" if said else None)
    for stated in ("complete", "stopped"):
        (tmp_path / "a.toml").write_text(f'outcome = "{stated}"\n')
        cut = said and stated == "complete"
        assert import_csv(tmp_path / "a.csv").record.outcome == ("interrupted" if cut else stated)


def test_errors_of_a_table_are_short(tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_bytes(b"time,position_1\n0," + bytes(100_000) + b"1\n")
    with pytest.raises(TraceError, match="is not a finite number") as told:
        import_csv(tmp_path / "a.csv")
    assert len(str(told.value)) < 300 + len(str(tmp_path))


def test_a_period_that_is_longer_than_the_time_between_rows_is_refused(tmp_path: Path) -> None:
    path = csv(tmp_path / "a.csv", *(f"{0.01 * k:.2f},1" for k in range(10)))
    (tmp_path / "a.toml").write_text("\ufeffperiod = 10\n", "utf-8")  # with a byte-order mark, as some editors write
    with pytest.raises(TraceError, match=r"period = 10 s, and its rows are 0\.01 s apart; write it in s"):
        import_csv(path)
    (tmp_path / "a.toml").write_text("period = 0.01\n")
    assert import_csv(path).record.period == 0.01
