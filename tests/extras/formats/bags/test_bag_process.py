"""A bag that needs more than its limits ends a process of its own; a damaged one is told in one line."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from mcap.writer import Writer
from rosbags.rosbag1 import Writer as Writer1
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin
from rosbags.rosbag2 import Writer as Writer2
from rosbags.typesys import Stores, get_typestore

from daq.contracts.errors import TraceError
from daq.contracts.import_choice import Choice
from daq.contracts.trace import Trace
from daq.contracts.trace_limits import TraceLimits
from extras.formats.bags.bag_process import import_bag_apart
from extras.formats.bags.joint_messages import JOINT_STATE
from extras.formats.bags.ros_bag import import_bag
from tests.daq.traces.file_fuzz import CASES, LIMITS, ROWS, Kind, campaign
from tests.extras.formats.bags.test_ros_bag import bag, state

MIB = 1 << 20
SMALL = TraceLimits(file_bytes=8 * MIB, total_bytes=8 * MIB, chunk_bytes=8 * MIB)
BOMB = bytes(256 * MIB)


def test_a_trace_from_another_process_is_the_same_to_the_bit(tmp_path: Path) -> None:
    path = bag(tmp_path / "ä", [{"velocity": [0.1, 0.2]}] * 5, topics=("/left", "/right"))
    choice = Choice(topic="/right", joints=("lift",), received=True, drive_unit="A")
    assert import_bag_apart(path, SMALL, choice) == import_bag(path, SMALL, choice)


def test_a_bag_whose_file_is_compressed_as_a_whole_is_read(tmp_path: Path) -> None:
    store: Any = get_typestore(Stores.ROS2_HUMBLE)
    writer = Writer2(tmp_path / "a", version=9)
    writer.set_compression(CompressionMode.FILE, CompressionFormat.ZSTD)
    with writer:
        connection = writer.add_connection("/joint_states", JOINT_STATE, typestore=store)
        for number in range(3):
            writer.write(connection, number, store.serialize_cdr(state(store, number), JOINT_STATE))
    assert len(import_bag_apart(tmp_path / "a", SMALL, Choice(drive_unit="none"))) == 3


def ros_1(path: Path) -> Path:
    store: Any = get_typestore(Stores.ROS1_NOETIC)
    writer = Writer1(path)
    writer.set_compression(Writer1.CompressionFormat.LZ4)
    with writer:
        writer.write(writer.add_connection("/joint_states", JOINT_STATE, typestore=store), 0, BOMB)
    return path


def messages(path: Path) -> Path:
    store = get_typestore(Stores.ROS2_HUMBLE)
    writer = Writer2(path, version=9)
    writer.set_compression(CompressionMode.MESSAGE, CompressionFormat.ZSTD)
    with writer:
        writer.write(writer.add_connection("/joint_states", JOINT_STATE, typestore=store), 0, BOMB)
    return path


@pytest.mark.parametrize(
    ("make", "name", "complaint"),
    [
        (ros_1, "a.bag", r"needs more memory than it may use \(traces\.limits"),
        (messages, "a", "a message has more than 1048576 bytes uncompressed"),
    ],
)
def test_what_uncompresses_to_more_than_the_memory_is_refused(
    tmp_path: Path, make: Any, name: str, complaint: str
) -> None:
    path = make(tmp_path / name)
    with pytest.raises(TraceError, match=complaint) as told:
        import_bag_apart(path, SMALL)
    assert "\n" not in str(told.value)


def test_an_error_comes_back_in_its_own_words(tmp_path: Path) -> None:
    with pytest.raises(TraceError, match=r"absent\.bag: cannot be read: No such file"):
        import_bag_apart(tmp_path / "absent.bag")


# ---- damaged bags (`tests.daq.traces.file_fuzz`)


def _bag(folder: Path, kind: str) -> Path:
    """A bag of joint states of two joints that move, written by its own library."""
    store: Any = get_typestore(Stores.ROS1_NOETIC if kind == "ROS 1" else Stores.ROS2_JAZZY)
    types = store.types
    messages = []
    for number in range(ROWS):
        moment = 1_700_000_000 * 10**9 + number * 10**7
        stamp = types["builtin_interfaces/msg/Time"](sec=moment // 10**9, nanosec=moment % 10**9)
        own = {"seq": number} if kind == "ROS 1" else {}
        header = types["std_msgs/msg/Header"](stamp=stamp, frame_id="", **own)
        values = {name: np.array([0.1 * number, -0.2 * number]) for name in ("position", "velocity", "effort")}
        message = types[JOINT_STATE](header=header, name=["pan", "lift"], **values)
        write = store.serialize_ros1 if kind == "ROS 1" else store.serialize_cdr
        messages.append((moment, bytes(write(message, JOINT_STATE))))
    if kind == "ROS 1":
        with Writer1(folder / "a.bag") as old:
            connection = old.add_connection("/joint_states", JOINT_STATE, typestore=store)
            for moment, data in messages:
                old.write(connection, moment, data)
        return folder / "a.bag"
    if kind == "MCAP":
        with (folder / "a.mcap").open("wb") as stream:
            writer = Writer(stream, chunk_size=2000, enable_data_crcs=True)
            writer.start("ros2", "fuzz")
            channel = writer.register_channel(
                "/joint_states", "cdr", writer.register_schema(JOINT_STATE, "ros2msg", b"")
            )
            for moment, data in messages:
                writer.add_message(channel, moment, data, moment)
            writer.finish()  # type: ignore[no-untyped-call]
        return folder / "a.mcap"
    with Writer2(folder / "a", version=9, storage_plugin=StoragePlugin.SQLITE3) as new:
        connection2 = new.add_connection("/joint_states", JOINT_STATE, typestore=store)
        for moment, data in messages:
            new.write(connection2, moment, data)
    return folder / "a"


def _read_bag(path: Path) -> Trace:
    return import_bag(path, LIMITS, Choice(drive_unit="N·m"))


def kinds(folder: Path) -> list[Kind]:
    """A sound bag of every kind, each in a folder of its own."""
    found = []
    for name, kind, inside in (
        ("bag of ROS 1", "ROS 1", ""),
        ("bag of MCAP", "MCAP", ""),
        ("bag of SQLite", "SQLite", "a.db3"),
        ("metadata of a bag", "SQLite", "metadata.yaml"),
    ):
        (folder / name).mkdir()
        bag = _bag(folder / name, kind)
        changed = bag / inside if inside else bag
        found.append(Kind(name, bag, changed, _read_bag, changed.read_bytes()))
    return found


@pytest.mark.parametrize("cases", [200, pytest.param(CASES // 3, marks=[pytest.mark.slow, pytest.mark.timeout(3600)])])
def test_damaged_bags_are_refused_in_one_line_or_read_as_a_whole(tmp_path: Path, cases: int) -> None:
    tally = campaign(cases, 2, kinds(tmp_path))
    assert not tally.faults, "\n".join(tally.examples)
    assert tally.ends["read"] > cases // 10
