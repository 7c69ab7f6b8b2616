"""CSV out and in again, to the bit; one line for what is wrong in a file; and what opens a file of any kind."""

import dataclasses
import os
import tomllib
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from daq.contracts.errors import TraceError
from daq.contracts.trace import EARLIEST, Trace
from daq.contracts.trace_limits import TraceLimits
from daq.traces.csv_table import FILE_TIME, export_csv, import_csv
from daq.traces.files import open_trace
from daq.traces.kinds import kind_of
from daq.traces.reader import read_trace
from daq.traces.store import write_trace
from daq.traces.verify import verify
from tests.daq.traces.samples import CREATED, record, write

number = st.floats(-1e6, 1e6)


@settings(max_examples=40, deadline=None)
@given(st.data())
def test_a_trace_comes_back_from_csv_to_the_bit(tmp_path_factory: pytest.TempPathFactory, data: st.DataObject) -> None:
    joints = tuple(sorted(data.draw(st.sets(st.integers(1, 6), min_size=1, max_size=3))))
    period = data.draw(st.sampled_from([1, 1_000, 10_000, 86_400_000_000]))  # µs, to the longest that is allowed
    ticks = st.integers(-(10**12) // period, 10**12 // period)
    time = np.array(sorted(data.draw(st.sets(ticks, min_size=1, max_size=10)))) * period * 1e-6
    table = st.lists(
        st.lists(number, min_size=len(joints), max_size=len(joints)), min_size=len(time), max_size=len(time)
    ).map(np.array)
    signals = {name: data.draw(st.none() | table) for name in ("set_point", "drive", "velocity")}
    text = st.text(st.characters(exclude_categories=["Cs"]), max_size=20)
    about = record(
        robot=data.draw(text),
        operator=data.draw(st.none() | text),
        notes=data.draw(text),
        source="real",
        outcome="stopped",
    )
    about = about.model_copy(update={"period": period * 1e-6})
    trace = Trace(about, joints, time, data.draw(table), **signals)
    back = import_csv(export_csv(trace, tmp_path_factory.mktemp("csv") / "rig.csv"))
    for field in dataclasses.fields(Trace):
        expected = getattr(trace, field.name)
        if isinstance(expected, np.ndarray) or field.name in signals:
            np.testing.assert_array_equal(getattr(back, field.name), expected)
    assert back.joints == joints
    for name in ("robot", "operator", "notes", "source", "outcome", "created", "machine", "drive_unit", "period"):
        assert getattr(back.record, name) == getattr(about, name), name


def test_whole_counts_of_the_machine_have_two_digits_more_than_a_count(tmp_path: Path) -> None:
    trace = read_trace(write(tmp_path / "a.mcap", 3))
    assert trace.record.machine is not None
    scale, volts = trace.record.machine.calibration(1), trace.record.machine.drive_scale(1)
    counted = dataclasses.replace(
        trace,
        position=np.full_like(trace.position, scale.counts_to_rad(1000)),
        set_point=np.full_like(trace.position, scale.posture_to_rad(244)),
        drive=np.full_like(trace.position, volts.counts_to_volts(3)),
    )
    made = export_csv(counted, tmp_path / "a.csv")
    _, *rows = made.read_text().splitlines()
    assert [len(text.partition(".")[2]) for text in rows[1].split(",")[1:4]] == [5, 5, 3]
    back = import_csv(made)
    assert np.max(np.abs(back.position - counted.position)) < abs(scale.rad_per_count) / 100
    # Readings that are no counts, such as those of a simulation, come back exactly
    finer = dataclasses.replace(counted, position=counted.position + 1e-5)
    np.testing.assert_array_equal(import_csv(export_csv(finer, tmp_path / "b.csv")).position, finer.position)


def test_notes_keep_their_blanks(tmp_path: Path) -> None:
    trace = read_trace(write(tmp_path / "a.mcap", 3, notes=" \n\u00a0"))
    assert import_csv(export_csv(trace, tmp_path / "a.csv")).record.notes == " \n\u00a0"


def test_a_file_has_the_same_identity_wherever_it_lies_and_another_when_it_says_something_else(tmp_path: Path) -> None:
    trace = read_trace(write(tmp_path / "a.mcap", 3))
    (tmp_path / "far").mkdir()
    here, there = export_csv(trace, tmp_path / "b.csv"), export_csv(trace, tmp_path / "far" / "c.csv")
    identity = import_csv(here).record.trace_id
    assert len(identity) == 12
    assert import_csv(here).record.trace_id == import_csv(there).record.trace_id == identity
    there.write_text(there.read_text().replace("2.01", "2.02", 1))
    assert import_csv(there).record.trace_id != identity
    beside = here.with_suffix(".toml")
    beside.write_text(beside.read_text().replace("0.02", "0.01", 1))
    assert import_csv(here).record.trace_id != identity


def test_the_same_trace_gives_the_same_bytes_and_names_only_a_machine_that_ships(tmp_path: Path) -> None:
    trace = read_trace(write(tmp_path / "a.mcap", 3))
    first, second = export_csv(trace, tmp_path / "b.csv"), export_csv(trace, tmp_path / "c.csv")
    assert first.read_bytes() == second.read_bytes()
    header, row, *_ = first.read_text().splitlines()
    assert header.split(",")[:5] == [
        "time [s]",
        "set_point_1 [rad]",
        "position_1 [rad]",
        "drive_1 [V]",
        "set_point_2 [rad]",
    ]
    assert row.startswith("0.0,2.01")
    assert tomllib.loads((tmp_path / "b.toml").read_text()) == {
        "source": "mock",
        "machine": "ma2000",
        "robot": "ma2000",
        "joints": [1, 2, 3],
        "drive_unit": "V",
        "period": 0.02,
        "created": CREATED,
        "outcome": "complete",
    }
    # A name alone would not be found again
    assert trace.record.machine is not None
    own = trace.record.machine.model_copy(update={"name": "crane"})
    made = dataclasses.replace(trace, record=trace.record.model_copy(update={"machine": own}))
    export_csv(made, tmp_path / "b.csv")
    assert "machine" not in tomllib.loads((tmp_path / "b.toml").read_text())


def test_times_in_ms_are_asked_about_and_taken_where_they_are_stated(tmp_path: Path) -> None:
    path = tmp_path / "rig.csv"
    path.write_text("time,position_1\n" + "".join(f"{5 * k},0.5\n" for k in range(4)))
    assert "5 s apart. Are its times in ms?" in import_csv(path).record.notes
    path.with_suffix(".toml").write_text('time_unit = "ms"\n')
    stated = import_csv(path)
    assert "ms" not in stated.record.notes
    np.testing.assert_allclose(stated.time, [0.0, 0.005, 0.01, 0.015])


@pytest.mark.parametrize(("begins", "unit"), [("1700000000", "s"), ("1700000000000", "ms")])
def test_times_since_1970_count_from_the_first_row_to_the_digit(begins: str, unit: str, tmp_path: Path) -> None:
    path = tmp_path / "rig.csv"
    path.write_text(f"time,position_1\n{begins}.000001,0.5\n{begins}.000003,0.6\n")
    path.with_suffix(".toml").write_text(f'time_unit = "{unit}"\n')
    trace = import_csv(path)
    np.testing.assert_allclose(trace.time, [0.0, 2e-6 if unit == "s" else 2e-9], rtol=1e-9)
    assert f"which is at {begins}.000001 {unit}." in trace.record.notes


def test_a_file_of_another_tool_needs_no_toml(tmp_path: Path) -> None:
    path = tmp_path / "rig.csv"
    path.write_bytes(b"\xef\xbb\xbftime, position_1 ,drive_1\r\n0,1,2\r\n0.5,1e-3, -4\r\n\r\n")
    trace = import_csv(path)
    assert (trace.joints, trace.record.source, trace.record.robot) == ((1,), "imported", "rig")
    assert trace.record.outcome is None
    os.utime(path, (1e9, 1e9))
    again = [import_csv(path).record for _ in range(2)]
    assert again[0] == again[1]
    assert (again[0].created.isoformat(), again[0].notes) == ("2001-09-09T01:46:40+00:00", FILE_TIME)
    os.utime(path, (-1e9, -1e9))  # no time at which a trace can have been recorded
    assert import_csv(path).record.created == EARLIEST
    np.testing.assert_array_equal(trace.position[:, 0], [1, 0.001])
    assert trace.drive is not None
    np.testing.assert_array_equal(trace.drive[:, 0], [2, -4])
    assert trace.set_point is None


@pytest.mark.parametrize(
    ("text", "complaint"),
    [
        ("", "has no rows"),
        ("speed,angle_1\n0,1\n", "its columns have other names than this program's: speed, angle_1; nothing looks"),
        ("time,position_1,position_1\n", "row 1, column 3: 'position_1' comes twice"),
        (
            "time,setpoint_1,position_1\n",
            "row 1, column 2: 'setpoint_1' is not known; allowed are time and set_point_N",
        ),
        ("time,position_1,position_0\n", "row 1, column 3: 'position_0' is not known"),
        ("time,drive_1\n0,0\n", "row 1: column 'position_1' is missing"),
        ("time,position_1,position_2,drive_1\n", "row 1: column 'drive_2' is missing; joint 1 has one"),
        ("time,position_1\n0,1\n0.1,nan\n", "row 3, column 'position_1': 'nan' is not a finite number"),
        ("time,position_1\n0,1\n0.1,inf\n", "row 3, column 'position_1': 'inf' is not a finite number"),
        ("time,position_1\n0,1\n0.1,fast\n", "row 3, column 'position_1': 'fast' is not a finite number"),
        ("time,position_1\n0,1_0\n", "row 2, column 'position_1': '1_0' is not a finite number"),
        ("time,position_1\n0,\n", "row 2, column 'position_1': '' is not a finite number"),
        ("time,position_1\n0,1\n0.1\n", "row 3: has 1 values for 2 columns"),
        ("time,position_1\n0,1\n0.2,1\n0.1,1\n", "row 4, column 'time': 0.1 does not increase after 0.2"),
        ("time,position_1\n0,1\n0,1\n", "row 3, column 'time': 0.0 does not increase after 0.0"),
    ],
)
def test_one_line_names_the_row_and_the_column(tmp_path: Path, text: str, complaint: str) -> None:
    path = tmp_path / "rig.csv"
    path.write_text(text)
    with pytest.raises(TraceError, match=r"^[^\n]*$") as caught:
        import_csv(path)
    assert str(caught.value).startswith(f"{path}: {complaint}")


@pytest.mark.parametrize(
    ("toml", "complaint"),
    [
        ("joints = [", "rig.toml: not TOML"),
        ("joint = [1]", "rig.toml: joint: there is no such field here; did you mean 'joints'?"),
        ("joints = [0]", "rig.toml: joints.1: found 0, must be at least 1"),
        ("joints = [2]", "rig.csv: row 1: column 'position_2' is missing"),
        ("machine = 'crane.toml'", "rig.toml: machine: machine '"),
        ("drive_unit = 'kV'", "rig.toml: drive_unit: found 'kV', must be 'V', 'A', 'N·m', 'N' or 'none'"),
    ],
)
def test_one_line_names_what_is_wrong_beside_the_file(tmp_path: Path, toml: str, complaint: str) -> None:
    path = tmp_path / "rig.csv"
    path.write_text("time,position_1\n0,1\n")
    path.with_suffix(".toml").write_text(toml)
    with pytest.raises(TraceError, match=r"^[^\n]*$") as caught:
        import_csv(path)
    assert str(caught.value).startswith(f"{tmp_path}/{complaint}")


def test_a_file_that_cannot_be_read_or_whose_period_does_not_fit_is_refused(tmp_path: Path) -> None:
    with pytest.raises(TraceError, match=r"absent\.csv: cannot be read: No such file"):
        import_csv(tmp_path / "absent.csv")
    (tmp_path / "a.csv").write_bytes(b"time,position_1\n0,\xff\n")
    with pytest.raises(TraceError, match="is not text in UTF-8"):
        import_csv(tmp_path / "a.csv")
    trace = read_trace(write(tmp_path / "a.mcap", 3))
    with pytest.raises(TraceError, match="cannot be written: No such file"):
        export_csv(trace, tmp_path / "absent" / "a.csv")
    path = csv(tmp_path / "b.csv", *(f"{0.01 * k:.2f},1" for k in range(10)))
    (tmp_path / "b.toml").write_text("\ufeffperiod = 10\n", "utf-8")  # with a byte-order mark, as some editors write
    with pytest.raises(TraceError, match=r"period = 10 s, and its rows are 0\.01 s apart; write it in s"):
        import_csv(path)
    (tmp_path / "b.toml").write_text("period = 0.01\n")
    assert import_csv(path).record.period == 0.01


# ---- What opens a file of any kind: its content decides, whatever it is called, and every joint comes along

SEVEN = ",".join(["time", *(f"position_{joint}" for joint in range(1, 8))])


def csv(path: Path, *rows: str, head: str = "time,position_1") -> Path:
    path.write_text("".join(f"{row}\n" for row in (head, *rows)))
    return path


def test_a_files_content_says_what_it_is_and_errors_are_short(tmp_path: Path) -> None:
    table, trace = csv(tmp_path / "RIG.CSV", "0,1", "0.1,2"), write(tmp_path / "a.mcap", 3)
    renamed = trace.rename(tmp_path / "TRACE.dat")
    assert [kind_of(path) for path in (table, renamed)] == ["csv", "trace"]
    assert (len(open_trace(table)), len(open_trace(renamed))) == (2, 3)
    found = verify(table)
    assert found.trustworthy
    assert [finding.message[:6] for finding in found.findings] == ["is CSV", "sample"]
    (tmp_path / "a.csv").write_bytes(b"time,position_1\n0," + bytes(100_000) + b"1\n")
    with pytest.raises(TraceError, match="is not a finite number") as told:
        import_csv(tmp_path / "a.csv")
    assert len(str(told.value)) < 300 + len(str(tmp_path))


def test_an_arm_of_seven_joints_is_written_and_read(tmp_path: Path) -> None:
    row = "1,2,3,4,5,6,7"
    trace = import_csv(csv(tmp_path / "panda.csv", f"0,{row}", f"0.1,{row}", head=SEVEN))
    path = write_trace(trace, tmp_path / "panda.mcap")
    assert read_trace(path).joints == tuple(range(1, 8))
    with pytest.raises(TraceError, match=r"not 1 to 6 different numbers of joints \(traces\.limits\.joints\)"):
        write_trace(trace, tmp_path / "b.mcap", TraceLimits(joints=6))
    assert sorted(path.name for path in tmp_path.iterdir()) == ["panda.csv", "panda.mcap"]  # nothing unreadable is kept


def test_traces_are_equal_when_they_say_the_same_and_miss_nothing_without_ticks(tmp_path: Path) -> None:
    path = write(tmp_path / "a.mcap", 5)
    one, other = read_trace(path), read_trace(path)
    assert one == other
    assert len({one, other}) == 1
    moved = Trace(one.record, one.joints, one.time, one.position + 1e-9)
    assert one != moved
    assert one != "trace"
    table = import_csv(csv(tmp_path / "a.csv", "0,1", "0.01,1", "0.02,1", "20.02,1"))
    line = "usually 0.01 s apart, at most 20 s (after 0.02 s)"
    assert table.missing_text.startswith(line)
    assert line in table._repr_html_()


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
