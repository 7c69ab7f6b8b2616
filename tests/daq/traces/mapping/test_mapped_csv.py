"""Text with columns of any names: a mapping says what they are, and nothing is guessed without a word."""

import math
from pathlib import Path

import numpy as np
import pytest

from daq.contracts.errors import TraceError
from daq.contracts.import_choice import Choice
from daq.traces.description import remember
from daq.traces.files import open_trace
from daq.traces.store import write_trace

ROWS = ["0,10,20,0.5,-0.5,1", "10,11,22,0.6,-0.6,2", "20,12,24,0.7,-0.7,2", "30,13,26,0.8,-0.8,1"]
HEAD = "stamp,q0,q1,tau0,tau1,mode"


def file(path: Path, rows: list[str], head: str = HEAD) -> Path:
    path.write_text("".join(f"{row}\n" for row in (head, *rows)))
    return path


def test_a_mapping_names_columns_units_and_joints_and_is_kept_beside_the_file(tmp_path: Path) -> None:
    path = file(tmp_path / "arm.csv", ROWS)
    path.with_suffix(".toml").write_text('# bench\nrobot = "bench 2"\n')
    choice = Choice(map={"time": "stamp in ms", "position": "q{} in deg", "drive": "2*tau{} in mA"})
    trace = open_trace(path, choice=choice)
    np.testing.assert_allclose(trace.time, [0, 0.01, 0.02, 0.03])
    np.testing.assert_allclose(trace.position[1], np.radians([11, 22]))
    assert trace.drive is not None
    np.testing.assert_allclose(trace.drive[1], [0.0012, -0.0012])
    assert (trace.joints, trace.record.drive_unit, trace.record.robot) == ((1, 2), "A", "bench 2")
    remember(path, choice, trace.record.columns)
    assert open_trace(path) == trace
    toml = path.with_suffix(".toml")
    assert toml.read_text().startswith('# bench\nrobot = "bench 2"\n')
    by_hand = '[map]  # by hand\ntime = "stamp in ms"\n'
    for text in (by_hand, "map = { time = 'stamp in ms' }\n", "map.time = 'stamp in ms'\n"):
        toml.write_text(text)
        remember(path, choice, trace.record.columns)
        assert open_trace(path).record.columns == trace.record.columns
    again = Choice(map={"time": "stamp in s"})
    remember(path, again, open_trace(path, choice=again).record.columns)
    assert open_trace(path).time[-1] == 30.0
    assert open_trace(write_trace(trace, tmp_path / "a.mcap")).record.columns["position"] == "q{} in deg"


def test_what_is_guessed_is_shown_and_asked_for(tmp_path: Path) -> None:
    path = file(tmp_path / "arm.csv", ROWS)
    with pytest.raises(TraceError) as asked:
        open_trace(path)
    assert "stamp, q0, q1, tau0, tau1, mode" in str(asked.value)
    assert "not stated: the unit of position" in str(asked.value)
    assert "--map 'time=stamp in ms' --map 'position=q{} in ?' --map 'drive=tau{} in ?'" in str(asked.value)
    stated = file(tmp_path / "stated.csv", ROWS, "time [ms],q0 [deg],q1 [deg],tau0 [Nm],tau1 [Nm],mode")
    with pytest.raises(TraceError, match="--as-guessed accepts this guess"):
        open_trace(stated)
    trace = open_trace(stated, choice=Choice(as_guessed=True))
    assert trace.record.columns == {
        "time": "time [ms] in ms",
        "position": "q{} [deg] in deg",
        "drive": "tau{} [Nm] in Nm",
    }
    named = "t,q_shoulder_joint,dq_shoulder_joint,q_wrist_1_joint,dq_wrist_1_joint,q_wrist_2_joint,dq_wrist_2_joint"
    with pytest.raises(TraceError, match=r"--map 'position=q_\{\} in \?' --map 'velocity=dq_\{\} in \?'"):
        open_trace(file(tmp_path / "named.csv", ["0,1,2,3,4,5,6"], named))
    speed = file(tmp_path / "bench.csv", ["0,1", "1,2"], "Time,Velo")  # words that are cut short
    with pytest.raises(TraceError, match=r"--map 'velocity=Velo in \?'"):
        open_trace(speed)
    partly = open_trace(path, choice=Choice(map={"time": "stamp in ms", "position": "q{}"}))
    assert partly.drive is None
    assert "Not taken: drive = tau{} in ?." in partly.record.notes


@pytest.mark.parametrize(
    ("given", "expected"),
    [
        ({"position": "q1, q0"}, [22, 11]),
        ({"position": "q{} - 1"}, [10, 21]),
        ({"position": "q{}", "position_2": "0.5*q1 + q0"}, [11, 22]),
        ({"position": "int16(big{})"}, [-1]),
        ({"position": "#"}, [1]),
        ({"position": "other.csv:x"}, [5]),
        ({"position": "long[{}::2]"}, [3, 4]),
        ({"position": "- q{}"}, [7]),
        ({"velocity": "q0 in deg/s"}, [0.5 * math.radians(21) * 0.01]),
    ],
)
def test_expressions(tmp_path: Path, given: dict[str, str], expected: list[float]) -> None:
    rows = ["0,10,20,65534,1,6", "10,11,22,65535,2,7"]
    path = file(tmp_path / "a.csv", rows, "stamp,q0,q1,big0,long,- q0")
    if "long" in given.get("position", ""):
        path = file(tmp_path / "a.csv", ["1", "2", "3", "4"], "long")
        file(tmp_path / "times.csv", ["0", "1"], "t")
        given |= {"time": "times.csv:t"}
    file(tmp_path / "other.csv", ["4", "5"], "x")
    trace = open_trace(path, choice=Choice(map={"time": "stamp in ms"} | given))
    np.testing.assert_allclose(trace.position[1], expected)


@pytest.mark.parametrize(
    ("given", "complaint"),
    [
        ({"angle": "q{}"}, "'angle' cannot be mapped"),
        ({"position": "q{} in feet"}, "position: unit 'feet' is unknown; write rad, deg"),
        ({"position": "theta{}"}, "no column matches 'theta{}'; the file has stamp, q0"),
        ({"position": "theta"}, "column 'theta' is missing; the file has stamp, q0"),
        ({"position": "q{}", "drive": "tau{}"}, "drive: its unit is not stated"),
        ({"position": "q{}", "drive": "tau0 in A"}, "drive: has no column of joint '0', which others have"),
        ({"position": "1.5 + 2"}, "'1.5 + 2' is not a column"),
        ({"position": "q{}", "drive": "tau{} in ‰"}, "drive: '‰' is a share: of what? As of a supply: ‰ of 7.4 V"),
        ({"position": "q{}", "drive": "tau{} in % of 12"}, "drive: '% of 12' is a share: of what?"),
    ],
)
def test_what_is_wrong_in_a_mapping_is_one_line(tmp_path: Path, given: dict[str, str], complaint: str) -> None:
    path = file(tmp_path / "a.csv", ROWS)
    with pytest.raises(TraceError) as error:
        open_trace(path, choice=Choice(map={"time": "stamp in ms"} | given))
    assert complaint in str(error.value)
    assert "\n" not in str(error.value)


def test_a_drive_may_be_a_share_of_a_stated_whole(tmp_path: Path) -> None:
    path = file(tmp_path / "servo.csv", ["0,1,500", "1,2,-250"], "t,q_1,present_load_1")
    with pytest.raises(TraceError, match=r"of drive \(.*for a share: ‰ of 7.4 V\)"):
        open_trace(path)
    for unit, base, expected in (
        ("‰ of 7.4 V", "V", 3.7),
        ("per mille of 2.94 N·m", "N·m", 1.47),
        ("% of 500 mA", "A", 2.5),
    ):
        given = {"time": "t in s", "position": "q_{} in rad", "drive": f"present_load_{{}} in {unit}"}
        trace = open_trace(path, choice=Choice(map=given))
        assert trace.drive is not None
        assert (trace.record.drive_unit, trace.drive[0, 0]) == (base, pytest.approx(expected))
        assert trace.record.columns["drive"] == given["drive"]
    with pytest.raises(TraceError, match=r"--drive-unit ‰: write V, A, .* for a share of that"):
        open_trace(path, choice=Choice(map=given, drive_unit="‰"))


def test_formats_whose_makers_state_the_units_are_not_asked_about(tmp_path: Path) -> None:
    names = ("target_q", "actual_q", "actual_qd", "actual_current")
    head = " ".join(["timestamp", *(f"{name}_{k}" for name in names for k in range(6)), "runtime_state"])
    rows = [" ".join(map(str, [1000.0 + 0.002 * row, *[0.1 * row] * 24, 1])) for row in range(5)]
    ur = open_trace(file(tmp_path / "robot_data.csv", rows, head))
    assert (len(ur.joints), ur.record.drive_unit) == (6, "A")
    assert ur.record.columns["drive"] == "actual_current_{} in A"
    panda = [f"state.{name}[{k}]" for name in ("q", "q_d", "dq", "dq_d", "tau_J") for k in range(7)]
    franka = [", ".join(map(str, [row, 1.0, *[0.2 * row] * 35])) for row in range(5)]
    seven = open_trace(file(tmp_path / "franka.csv", franka, ", ".join(["time", "success_rate", *panda])))
    assert (seven.joints, seven.record.drive_unit, seven.time[-1]) == (tuple(range(1, 8)), "N·m", 0.004)
    comma = file(tmp_path / "excel.csv", ["0;0,5", "0,01;0,75"], "time;position_1")
    np.testing.assert_allclose(open_trace(comma).position[:, 0], [0.5, 0.75])


def test_a_word_after_an_underscore_is_no_joint(tmp_path: Path) -> None:
    path = file(tmp_path / "speeds.csv", ["0,1,0.5", "0.1,1,0.6", "0.2,1,0.7"], "time,position_cmd,velocity")
    trace = open_trace(path, choice=Choice(map={"time": "time in s", "velocity": "velocity in rad/s"}))
    assert trace.record.columns == {"time": "time in s", "velocity": "velocity in rad/s"}
    assert (trace.joints, trace.velocity is not None) == ((1,), True)


def test_joints_with_names_keep_them_and_some_can_be_chosen(tmp_path: Path) -> None:
    head = "t,lift_pos,pan_pos,grip_pos"
    path = file(tmp_path / "a.csv", ["0,1,2,3", "1,1,2,3"], head)
    mapping = {"time": "t in s", "position": "{}_pos in rad"}
    trace = open_trace(path, choice=Choice(map=mapping))
    assert (trace.joints, trace.record.joint_names) == ((1, 2, 3), ("lift", "pan", "grip"))
    numbered = open_trace(path, choice=Choice(map=mapping, joints=("pan", "lift"), numbering=("pan", "lift")))
    assert (numbered.joints, numbered.record.joint_names) == ((1, 2), ("pan", "lift"))
    np.testing.assert_array_equal(numbered.position[0], [2, 1])
    with pytest.raises(TraceError, match="--joints pan,elbow: it has lift, pan, grip"):
        open_trace(path, choice=Choice(map=mapping, joints=("pan", "elbow")))
    stated = path.with_suffix(".toml")
    for columns in ("t,q1,q2,q3", "time,position_1,position_2,position_3"):
        path.write_text(f"{columns}\n0,1,2,3\n1,1,2,3\n")
        known = Choice(map={"time": "t in s", "position": "q{} in rad"} if "q1" in columns else {})
        stated.write_text('joint_names = ["lift", "pan", "grip"]\n')
        assert open_trace(path, choice=known).record.joint_names == ("lift", "pan", "grip")
        stated.write_text('joint_names = ["lift", "pan"]\n')
        with pytest.raises(TraceError, match="joint_names = lift, pan: its joints are 3 without names"):
            open_trace(path, choice=known)
    path.write_text(f"{head}\n0,1,2,3\n1,1,2,3\n")
    stated.write_text('joint_names = ["lift", "pan", "elbow"]\n')
    with pytest.raises(TraceError, match="joint_names = lift, pan, elbow: its joints are lift, pan, grip; state a"):
        open_trace(path, choice=Choice(map=mapping))


def test_records_in_one_file_rows_without_a_reading_and_times_that_come_twice(tmp_path: Path) -> None:
    rows = ["0,1,0", "1,nan,0", "1,2,0", "1,3,0", "0,4,1", "1,5,1"]
    path = file(tmp_path / "a.csv", rows, "t,q,episode")
    mapping = {"time": "t in s", "position": "q in rad"}
    with pytest.raises(TraceError, match=r"time goes back from 1 to 0 s: it has 2 records, episode 0 to 1; choose one"):
        open_trace(path, choice=Choice(map=mapping))
    first = open_trace(path, choice=Choice(map=mapping, where="episode=0"))
    np.testing.assert_array_equal(first.position[:, 0], [1, 2])
    assert first.record.where == "episode=0"
    rising = file(tmp_path / "b.csv", ["0,1,0", "1,2,0", "2,4,1", "3,5,1"], "t,q,episode")
    remember(rising, Choice(where="episode=0"), {"time": "t in s", "position": "q in rad"})
    assert [len(open_trace(rising, choice=Choice(where=where))) for where in (None, "all")] == [2, 4]
    assert "not a number, left out: 1, the first is data row 2" in first.record.notes
    assert "repeat the previous time, left out: 1, the first is data row 4" in first.record.notes
    with pytest.raises(TraceError, match="no row is left where time=7"):
        open_trace(path, choice=Choice(map=mapping, where="time=7..9"))


def test_moments_since_1970_and_in_iso_8601_count_from_the_first(tmp_path: Path) -> None:
    rows = ["2026-11-21T05:14:42.000Z,1", "2026-11-21T05:14:42.020Z,2"]
    trace = open_trace(file(tmp_path / "a.csv", rows, "stamp,q"), choice=Choice(map={"time": "stamp", "position": "q"}))
    np.testing.assert_allclose(trace.time, [0, 0.02], atol=1e-6)
    assert trace.record.created.year == 2026
