"""Bags that rosbags writes are imported, joint by joint; what is wrong with one is told in one line."""

import os
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import zstandard
from rosbags.rosbag1 import Writer as Writer1
from rosbags.rosbag2 import StoragePlugin
from rosbags.rosbag2 import Writer as Writer2
from rosbags.typesys import Stores, get_typestore

from daq.contracts.errors import TraceError
from daq.contracts.import_choice import Choice
from daq.contracts.joint_matching import matched
from daq.contracts.machine import Machine, load_machine
from daq.contracts.trace import Trace
from daq.contracts.trace_limits import DEFAULT_TRACE_LIMITS, TraceLimits
from daq.traces.files import open_trace
from daq.traces.kinds import kind_of
from daq.traces.reader import read_trace
from daq.traces.store import write_trace
from extras.formats.bags import PLUGIN
from extras.formats.bags.joint_messages import JOINT_STATE
from extras.formats.bags.ros_bag import import_bag
from tests.daq.traces.samples import record, write
from tests.daq.traces.test_csv_table import csv

NS = 10**9
START = 1_700_000_000 * NS
NAMES = ["pan", "lift"]


def state(store: Any, number: int, **changes: Any) -> Any:
    types = store.types
    given: dict[str, Any] = {
        "names": NAMES,
        "position": [0.1 * number, -0.2 * number],
        "velocity": [],
        "effort": [1.0, 2.0 + number],
        "stamp": START + number * NS // 100,
    } | changes
    stamp = types["builtin_interfaces/msg/Time"](sec=given["stamp"] // NS, nanosec=given["stamp"] % NS)
    extra = {"seq": number} if "seq" in types["std_msgs/msg/Header"].__dataclass_fields__ else {}
    header = types["std_msgs/msg/Header"](stamp=stamp, frame_id="", **extra)
    arrays = {name: np.array(given[name], np.float64) for name in ("position", "velocity", "effort")}
    return types[JOINT_STATE](header=header, name=list(given["names"]), **arrays)


def imported(path: Path, limits: TraceLimits = DEFAULT_TRACE_LIMITS, **choice: Any) -> Trace:
    """The trace in a bag whose effort is a torque."""
    return import_bag(path, limits, Choice(**({"drive_unit": "N·m"} | choice)))


def bag(
    path: Path, changes: list[dict[str, Any]], kind: str = "mcap", topics: tuple[str, ...] = ("/joint_states",)
) -> Path:
    """A bag with one message for each entry, on each topic, and a topic of text."""
    if kind == "ros1":
        store: Any = get_typestore(Stores.ROS1_NOETIC)
        with Writer1(path) as old:
            connection = old.add_connection(topics[0], JOINT_STATE, typestore=store)
            for number, change in enumerate(changes):
                message = store.serialize_ros1(state(store, number, **change), JOINT_STATE)
                old.write(connection, START + number * NS // 100, message)
        return path
    store = get_typestore(Stores.ROS2_HUMBLE)
    plugin = StoragePlugin.MCAP if kind == "mcap" else StoragePlugin.SQLITE3
    with Writer2(path, version=9, storage_plugin=plugin) as writer:
        text = writer.add_connection("/chatter", "std_msgs/msg/String", typestore=store)
        said = store.types["std_msgs/msg/String"](data="hello")
        writer.write(text, START, store.serialize_cdr(said, "std_msgs/msg/String"))
        for topic in topics:
            connection2 = writer.add_connection(topic, JOINT_STATE, typestore=store)
            for number, change in enumerate(changes):
                message = store.serialize_cdr(state(store, number, **change), JOINT_STATE)
                writer.write(connection2, START + 5 + number * NS // 100, message)
    return path


@pytest.mark.parametrize(("kind", "name"), [("mcap", "a"), ("sqlite3", "a"), ("ros1", "a.bag")])
def test_joint_states_of_every_kind_of_bag_become_a_trace(tmp_path: Path, kind: str, name: str) -> None:
    trace = imported(bag(tmp_path / name, [{}] * 5, kind))
    assert trace.joints == (1, 2)
    np.testing.assert_allclose(trace.time, np.arange(5) * 0.01, atol=1e-9)
    np.testing.assert_array_equal(trace.position, [[0.1 * k, -0.2 * k] for k in range(5)])
    assert trace.drive is not None
    np.testing.assert_array_equal(trace.drive[:, 1], [2.0 + k for k in range(5)])
    assert (trace.velocity, trace.record.drive_unit, trace.record.source) == (None, "N·m", "imported")
    assert trace.record.notes == "From topic /joint_states, joints 1 pan, 2 lift."
    assert int(trace.record.created.timestamp()) == START // NS
    back = read_trace(write_trace(trace, tmp_path / "made.mcap"))
    np.testing.assert_array_equal(back.position, trace.position)
    assert imported(tmp_path / name).record.trace_id == trace.record.trace_id


def test_bags_that_differ_in_date_velocity_or_effort_alone_are_different_traces(tmp_path: Path) -> None:
    later = {"stamp": START + 3600 * NS}
    changes: list[dict[str, Any]] = [{}, later, {"effort": [1.0, 3.0]}, {"effort": []}, {"velocity": [0.0, 1.0]}]
    traces = [imported(bag(tmp_path / str(number), [change])) for number, change in enumerate(changes)]
    assert len({trace.record.trace_id for trace in traces}) == len(changes)


def test_a_file_of_a_bag_is_read_without_its_folder(tmp_path: Path) -> None:
    for kind, suffix in (("mcap", ".mcap"), ("sqlite3", ".db3")):
        (file,) = bag(tmp_path / kind, [{}] * 3, kind).glob(f"*{suffix}")
        assert len(imported(file)) == 3


def test_joints_that_are_chosen_come_in_their_order_from_the_messages_that_have_them(tmp_path: Path) -> None:
    gripper = {"names": ["finger"], "position": [0.01], "effort": []}
    turned = {"names": ["lift", "pan"], "position": [7.0, 8.0]}
    path = bag(tmp_path / "a", [{}, gripper, turned])
    trace = imported(path, joints=("lift", "pan"))
    np.testing.assert_array_equal(trace.position, [[0.0, 0.0], [7.0, 8.0]])
    assert "Messages without all of these joints, left out: 1, the first is message 2." in trace.record.notes
    with pytest.raises(TraceError, match="messages of different joints: lift, pan in 2 messages; finger in 1 message;"):
        imported(path)


def test_the_toml_beside_a_bag_chooses_and_describes(tmp_path: Path) -> None:
    path = bag(tmp_path / "a", [{}] * 3, topics=("/left", "/right"))
    (tmp_path / "a.toml").write_text('topic = "/right"\njoints = ["lift"]\ndrive_unit = "A"\nrobot = "bench 2"\n')
    trace = imported(path, drive_unit=None)
    assert (trace.joints, trace.record.drive_unit, trace.record.robot) == ((1,), "A", "bench 2")


def test_a_velocity_that_is_not_measured_is_left_out(tmp_path: Path) -> None:
    nan = float("nan")
    trace = imported(bag(tmp_path / "a", [{"velocity": [1.0, 2.0]}, {"velocity": [1.0, nan]}]))
    assert trace.velocity is None
    assert "velocity was left out: 1 of 2 messages lack it." in trace.record.notes


@pytest.mark.parametrize(
    ("changes", "choice", "complaint"),
    [
        ([{}, {"position": []}], {}, "message 2: has 2 names and 0 positions"),
        ([{"position": [float("nan"), 0]}], {}, "not a number, left out: 1, the first is message 1. None is left"),
        ([{}], {"drive_unit": None}, "its effort may be in N·m, .*, or in amperes.*; give --drive-unit N·m, N, A or V"),
        ([{}, {"stamp": START - 5}], {}, "message 2: its time .* does not come after .*--received"),
        ([{}], {"topic": "/other"}, "topic /other: has no joint states; topics with some: /joint_states"),
        ([{}], {"joints": ("elbow",)}, "has no joint 'elbow'; it has pan, lift"),
        ([{}], {"joints": ("pan", "pan")}, "choose up to 99 different ones"),
        ([{"names": ["a\nb", "a\nb"]}], {}, "names a joint twice: a"),
        ([{"effort": [1.0]}], {}, "has 2 names and 1 values of effort"),
        ([{"names": [], "position": [], "effort": []}], {}, "has no joint states in 1 messages"),
        ([], {}, "has no joint states in 0 messages"),
        ([{"names": ["a" * 2_000_000, "b"]}], {}, "has more than 1048576 bytes, too many for joint states"),
        ([{"position": [1e300, 0.0]}], {}, "position = 1e.300"),
    ],
)
def test_what_is_wrong_in_a_bag_is_told_in_one_line(
    tmp_path: Path, changes: list[dict[str, Any]], choice: dict[str, Any], complaint: str
) -> None:
    path = bag(tmp_path / "a", changes)
    with pytest.raises(TraceError, match=complaint) as told:
        imported(path, **choice)
    assert "\n" not in str(told.value)


@pytest.mark.parametrize("name", ["x.bin", "x.db3", "x.zstd"])
def test_files_of_any_name_are_uncompressed_within_the_limit(tmp_path: Path, name: str) -> None:
    path = bag(tmp_path / "a", [{}])
    for frame in (b"", (0x184D2A50).to_bytes(4, "little") + bytes(4)):
        (path / name).write_bytes(frame + zstandard.compress(b"small") + zstandard.compress(bytes(1 << 20)))
        with pytest.raises(TraceError, match=f"{name}: has more than 1000000 bytes uncompressed"):
            imported(path, TraceLimits(file_bytes=1_000_000))
    (path / name).unlink()
    os.mkfifo(path / name)
    with pytest.raises(TraceError, match="cannot be read: it is no file"):
        imported(path)


def test_files_that_are_no_bag_are_told_in_one_line(tmp_path: Path) -> None:
    trace = write(tmp_path / "trace.mcap")
    damaged = tmp_path / "damaged.mcap"
    damaged.write_bytes(trace.read_bytes()[:9] + b"nonsense")
    whole = bag(tmp_path / "a", [{}] * 3)
    for name in ("x.db3", "x.bag"):
        (tmp_path / name).write_bytes(b"nonsense")
    for path, complaint in [
        (trace, "is already a trace"),
        (damaged, "has no topic of sensor_msgs/msg/JointState; it has no topic"),
        (tmp_path / "x.db3", "is neither MCAP nor SQLite nor a bag of ROS 1"),
        (tmp_path / "x.bag", "is neither MCAP nor SQLite nor a bag of ROS 1"),
        (tmp_path / "absent.db3", "cannot be read"),
        (tmp_path, "is a folder without metadata.yaml"),
    ]:
        with pytest.raises(TraceError, match=complaint) as told:
            imported(path)
        assert "\n" not in str(told.value)
    with pytest.raises(TraceError, match=r"traces\.limits\.file_bytes"):
        imported(whole, TraceLimits(file_bytes=100))
    with pytest.raises(TraceError, match="has joint states on /l, /r; choose one with --topic"):
        imported(bag(tmp_path / "two", [{}], topics=("/l", "/r")))
    with pytest.raises(TraceError, match=r"has no topic of sensor_msgs/msg/JointState; it has /chatter \(std_msgs"):
        imported(bag(tmp_path / "none", [], topics=()))


# ---- which file is a bag, and which joints of one are a machine's


def test_a_files_content_says_what_it_is(tmp_path: Path) -> None:
    table, trace = csv(tmp_path / "RIG.CSV", "0,1", "0.1,2"), write(tmp_path / "a.mcap", 3)
    (made,) = bag(tmp_path / "bag", [{}] * 3, "sqlite3").glob("*.db3")
    renamed = [trace.rename(tmp_path / "TRACE.dat"), made.rename(tmp_path / "BAG.DB3")]
    assert [kind_of(path) for path in (table, *renamed)] == ["csv", "trace", PLUGIN.importers[0]]
    assert (len(open_trace(table)), len(open_trace(renamed[0])), len(imported(renamed[1]))) == (2, 3, 3)
    with pytest.raises(TraceError, match="its effort may be in N·m"):
        open_trace(renamed[1])


def named(*names: str) -> Machine:
    """The MA2000 with joints of these names."""
    machine = load_machine("ma2000")
    joints = tuple(j.model_copy(update={"name": n}) for j, n in zip(machine.joints, names, strict=False))
    return machine.model_copy(update={"joints": joints})


def test_joints_are_matched_by_name_and_never_by_the_order_that_they_came_in(tmp_path: Path) -> None:
    names = {"names": ["elbow", "pan", "lift"], "position": [3.0, 1.0, 2.0], "effort": []}
    path = bag(tmp_path / "ur", [names] * 3)
    machine = named("pan", "lift", "elbow")
    numbered = import_bag(path, choice=Choice(numbering=("pan", "lift", "elbow")))
    assert (numbered.joints, numbered.record.joint_names) == ((3, 1, 2), ("elbow", "pan", "lift"))
    kept = read_trace(write_trace(numbered, tmp_path / "a.mcap"))
    assert matched(kept, machine) is kept
    in_order = import_bag(path)
    assert in_order.joints == (1, 2, 3)
    assert matched(in_order, machine).joints == (3, 1, 2)
    with pytest.raises(TraceError, match="--joints and its own names for base, shoulder, upper, in this"):
        matched(in_order, named("base", "shoulder", "upper"))
    chosen = import_bag(path, choice=Choice(joints=("pan", "lift", "elbow")))
    assert np.array_equal(chosen.position[0], [1.0, 2.0, 3.0])
    assert matched(chosen, machine) is chosen
    assert matched(chosen, named("base", "shoulder", "upper")) is chosen  # a person has said which is which
    without = Trace(record(machine=None), (1, 2), np.arange(3.0), np.zeros((3, 2)))
    assert matched(without, machine) is without


def test_joints_that_a_machine_lacks_are_left_out_by_their_names(tmp_path: Path) -> None:
    names = {"names": ["grip", "elbow", "pan", "lift"], "position": [9.0, 3.0, 1.0, 2.0], "effort": []}
    path = bag(tmp_path / "ur", [names] * 3)
    machine = named("pan", "lift", "elbow")
    trace = import_bag(path)
    assert trace.joints == (1, 2, 3, 4)
    fitting = matched(trace, machine)
    assert (fitting.joints, fitting.record.joint_names) == ((3, 1, 2), ("elbow", "pan", "lift"))
    assert [fitting.position[0, fitting.column(joint)] for joint in (1, 2, 3)] == [1.0, 2.0, 3.0]
    assert import_bag(path, choice=Choice(numbering=("pan", "lift", "elbow"))).joints == (3, 1, 2)


def test_rows_of_a_stretch_of_time_are_taken(tmp_path: Path) -> None:
    path = bag(tmp_path / "run", [{}] * 10)
    trace = imported(path, where="time=0.02..0.05")
    np.testing.assert_allclose(trace.time, [0.02, 0.03, 0.04])
    np.testing.assert_allclose(trace.position[:, 0], [0.2, 0.3, 0.4])
    assert "Rows where time=0.02..0.05." in trace.record.notes
    for where, says in (("time=1..2", "no row is left where time=1..2"), ("lap=1", "column 'lap' is missing")):
        with pytest.raises(TraceError, match=says):
            imported(path, where=where)
