"""`daq traces import` of somebody else's bag: what is chosen, what is told, and what cannot be."""

import json
from pathlib import Path

import numpy as np

from daq.traces.reader import read_trace
from tests.daq.servo_bench import PAN_TILT
from tests.daq_cli.invoke import CommandLine
from tests.extras.formats.bags.test_ros_bag import bag


def test_the_joints_that_are_named_become_a_trace(daq: CommandLine, tmp_path: Path) -> None:
    path = bag(tmp_path / "a", [{}] * 5, topics=("/left", "/right"))
    choice = ("--topic", "/right", "--joints", "lift, pan", "--received", "--drive-unit", "none")
    words = (*choice, "--folder", tmp_path / "kept", "--json")
    made = json.loads(daq("traces", "import", path, *words).out)
    trace = read_trace(Path(made["file"]))
    np.testing.assert_array_equal(trace.position, [[-0.2 * k, 0.1 * k] for k in range(5)])
    assert "From topic /right, joints 1 lift, 2 pan." in trace.record.notes
    assert "Times are those at which messages were received." in trace.record.notes
    shown = daq("traces", "show", made["file"])
    assert (shown.code, "5 samples on joints 1, 2" in shown.out) == (0, True)


def test_what_is_no_bag_or_leaves_a_choice_is_told_in_one_line(daq: CommandLine, tmp_path: Path) -> None:
    two = bag(tmp_path / "two", [{}], topics=("/left", "/right"))
    daq("traces", "import", two).complains(2, "joint states on /left, /right; choose one with --topic")
    (tmp_path / "rig.csv").write_text("time,position_1\n0,0\n1,1\n")
    daq("traces", "import", tmp_path / "rig.csv", "--topic", "/left").complains(2, "exist only in bags")
    (tmp_path / "two.toml").write_text("topics = '/left'\n")
    daq("traces", "import", two).complains(2, "two.toml", "topics")


def test_joints_have_the_numbers_of_the_configured_machine_and_it_is_told(daq: CommandLine, tmp_path: Path) -> None:
    turned = {"names": ["tilt", "pan"], "position": [7.0, 8.0]}
    path = bag(tmp_path / "a", [turned] * 3)
    (tmp_path / "daq.toml").write_text(f'[robot]\nmachine = "{PAN_TILT}"\n')
    said = daq("--config", tmp_path / "daq.toml", "traces", "import", path, "--drive-unit", "Nm")
    assert "From topic /joint_states, joints 2 tilt, 1 pan." in said.err
    trace = read_trace(Path(said.out.strip()))
    assert trace.position[0, trace.column(1)] == 8.0
    other = daq("traces", "import", path, "--drive-unit", "Nm")
    assert "joints 1 tilt, 2 pan." in other.err
    assert read_trace(Path(other.out.strip())).record.trace_id != trace.record.trace_id


def test_a_folder_that_a_cut_off_recording_left_is_named_as_that(daq: CommandLine, tmp_path: Path) -> None:
    path = bag(tmp_path / "cut", [{}] * 3)
    (path / "metadata.yaml").unlink()
    daq("traces", "import", path).complains(2, "is a folder without metadata.yaml", f"name the file in it, {path}/")
    (tmp_path / "empty").mkdir()
    daq("traces", "import", tmp_path / "empty").complains(2, "is a folder without metadata.yaml")


def test_the_unit_of_the_effort_is_asked_for(daq: CommandLine, tmp_path: Path) -> None:
    path = bag(tmp_path / "a", [{}] * 3)
    daq("traces", "import", path).complains(2, "give --drive-unit N·m, N, A or V, or none to leave it out")
    daq("traces", "import", path, "--drive-unit", "kV").complains(2, "--drive-unit kV: write V, A, N·m, N, none")
    amperes, without = (daq("traces", "import", path, "--drive-unit", unit, "--json").out for unit in ("A", "none"))
    assert read_trace(Path(json.loads(amperes)["file"])).record.drive_unit == "A"
    assert read_trace(Path(json.loads(without)["file"])).drive is None
