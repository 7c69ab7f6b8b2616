"""The reader of bags takes damaged ones in one line, or says what is missing of them (`tests.daq.traces.file_fuzz`)."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from mcap.writer import Writer
from rosbags.rosbag1 import Writer as Writer1
from rosbags.rosbag2 import StoragePlugin
from rosbags.rosbag2 import Writer as Writer2
from rosbags.typesys import Stores, get_typestore

from daq.contracts.import_choice import Choice
from daq.contracts.trace import Trace
from extras.formats.bags.joint_messages import JOINT_STATE
from extras.formats.bags.ros_bag import import_bag
from tests.daq.traces.file_fuzz import CASES, LIMITS, ROWS, Kind, campaign


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
