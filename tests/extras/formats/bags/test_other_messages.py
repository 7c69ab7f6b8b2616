"""Set points of ros2_control, states of other interfaces, and MCAP in JSON and protobuf."""

import json
import struct
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from google.protobuf import descriptor_pb2, descriptor_pool, message_factory
from mcap.writer import Writer
from rosbags.rosbag2 import StoragePlugin
from rosbags.rosbag2 import Writer as Writer2
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from daq.contracts.errors import TraceError
from daq.contracts.import_choice import Choice
from daq.traces.files import open_trace
from extras.formats.bags.joint_messages import CONTROLLER_STATE, DYNAMIC_STATE, JOINT_STATE
from extras.formats.bags.ros_bag import import_bag
from tests.extras.formats.bags.test_ros_bag import NAMES, NS, START, state

POINTS = {
    "jazzy": ("reference", "feedback", "error", "output"),
    "humble": ("reference", "feedback", "error", "output", "desired", "actual"),
    "foxy": ("desired", "actual", "error"),
}
VALUES = "string[] interface_names\nfloat64[] values\n"


def store_of(release: str) -> Any:
    """ROS's types with control_msgs of a release."""
    store = get_typestore(Stores.ROS2_HUMBLE)
    text = "std_msgs/Header header\nstring[] joint_names\n"
    text += "".join(f"trajectory_msgs/JointTrajectoryPoint {name}\n" for name in POINTS[release])
    if release != "foxy":
        text += "string[] multi_dof_joint_names\n"
        text += "".join(f"trajectory_msgs/MultiDOFJointTrajectoryPoint multi_dof_{n}\n" for n in POINTS[release])
    store.register(get_types_from_msg(text, CONTROLLER_STATE))
    store.register(get_types_from_msg(VALUES, "control_msgs/msg/InterfaceValue"))
    dynamic = "std_msgs/Header header\nstring[] joint_names\ncontrol_msgs/InterfaceValue[] interface_values\n"
    store.register(get_types_from_msg(dynamic, DYNAMIC_STATE))
    return store


def header(store: Any, moment: int) -> Any:
    stamp = store.types["builtin_interfaces/msg/Time"](sec=moment // NS, nanosec=moment % NS)
    return store.types["std_msgs/msg/Header"](stamp=stamp, frame_id="")


def controller_state(store: Any, release: str, number: int) -> Any:
    """Set points of 0.1 times the number, positions 0.01 below."""
    types = store.types
    span = types["builtin_interfaces/msg/Duration"](sec=0, nanosec=0)

    def point(value: float) -> Any:
        values, none = np.full(2, value), np.zeros(0)
        return types["trajectory_msgs/msg/JointTrajectoryPoint"](
            positions=values, velocities=none, accelerations=none, effort=none, time_from_start=span
        )

    several = types["trajectory_msgs/msg/MultiDOFJointTrajectoryPoint"](
        transforms=[], velocities=[], accelerations=[], time_from_start=span
    )
    asked = 0.1 * number
    by_name = {"reference": asked, "desired": asked, "feedback": asked - 0.01, "actual": asked - 0.01}
    points = {name: point(by_name.get(name, 0.0)) for name in POINTS[release]}
    more = {} if release == "foxy" else {f"multi_dof_{name}": several for name in POINTS[release]}
    more |= {} if release == "foxy" else {"multi_dof_joint_names": []}
    moment = START + number * NS // 100
    return types[CONTROLLER_STATE](header=header(store, moment), joint_names=NAMES, **points, **more)


def bag(path: Path, release: str, *, with_states: bool = False, effort: Sequence[float] = ()) -> Path:
    """Ten controller's states, and where it is wanted joint states between them."""
    store = store_of(release)
    with Writer2(path, version=9, storage_plugin=StoragePlugin.SQLITE3) as writer:
        there = writer.add_connection("/arm/controller_state", CONTROLLER_STATE, typestore=store)
        for number in range(10):
            moment = START + number * NS // 100
            raw = store.serialize_cdr(controller_state(store, release, number), CONTROLLER_STATE)
            writer.write(there, moment, raw)
        if with_states:
            states = writer.add_connection("/joint_states", JOINT_STATE, typestore=store)
            for number in range(10):
                moment = START + number * NS // 100 - NS // 200
                message = state(store, number, stamp=moment, effort=effort)
                writer.write(states, moment, store.serialize_cdr(message, JOINT_STATE))
    return path


@pytest.mark.parametrize("release", list(POINTS))
def test_a_controllers_state_of_every_release_has_set_points(tmp_path: Path, release: str) -> None:
    trace = import_bag(bag(tmp_path / "a", release))
    assert trace.set_point is not None
    np.testing.assert_allclose(trace.set_point[:, 0], 0.1 * np.arange(10))
    np.testing.assert_allclose(trace.set_point - trace.position, 0.01)
    assert trace.record.joint_names == tuple(NAMES)


def test_set_points_of_another_topic_are_held_until_the_next_come(tmp_path: Path) -> None:
    path = bag(tmp_path / "a", "jazzy", with_states=True)
    alone = import_bag(path)
    assert alone.set_point is None
    assert "Its set points are on /arm/controller_state: --set-points takes them." in alone.record.notes
    trace = import_bag(path, choice=Choice(set_points="/arm/controller_state"))
    assert trace.set_point is not None
    np.testing.assert_allclose(trace.set_point[:, 0], 0.1 * np.arange(9))
    assert "Messages before the first set point, left out: 1" in trace.record.notes
    np.testing.assert_allclose(trace.time[:3], [0, 0.01, 0.02])


def test_states_of_any_interfaces_are_read_where_they_are_positions(tmp_path: Path) -> None:
    store = store_of("jazzy")
    value = store.types["control_msgs/msg/InterfaceValue"]
    with Writer2(tmp_path / "a", version=9, storage_plugin=StoragePlugin.SQLITE3) as writer:
        there = writer.add_connection("/dynamic_joint_states", DYNAMIC_STATE, typestore=store)
        for number in range(4):
            moment = START + number * NS // 100
            values = [
                value(interface_names=["velocity", "position"], values=np.array([0.5, 0.1 * number])),
                value(interface_names=["position", "velocity"], values=np.array([0.2 * number, 0.7])),
                value(interface_names=["digital_in"], values=np.array([1.0])),
            ]
            message = store.types[DYNAMIC_STATE](
                header=header(store, moment), joint_names=[*NAMES, "gpio"], interface_values=values
            )
            writer.write(there, moment, store.serialize_cdr(message, DYNAMIC_STATE))
    trace = import_bag(tmp_path / "a")
    assert trace.record.joint_names == tuple(NAMES)
    np.testing.assert_allclose(trace.position[3], [0.3, 0.6])
    assert trace.velocity is not None
    np.testing.assert_allclose(trace.velocity[0], [0.5, 0.7])


def mcap(path: Path, encoding: str, name: str, schema: bytes, messages: list[bytes]) -> Path:
    with path.open("wb") as stream:
        writer = Writer(stream)
        writer.start()
        kind = writer.register_schema(name, "jsonschema" if encoding == "json" else "protobuf", schema)
        channel = writer.register_channel("/arm", encoding, kind)
        for number, raw in enumerate(messages):
            moment = START + number * NS // 100
            writer.add_message(channel, moment, raw, moment)
        writer.finish()
    return path


def test_messages_in_json_are_a_table_with_joints_by_name(tmp_path: Path) -> None:
    rows = [{"name": NAMES, "position": [0.1 * n, 0.2 * n], "temperature": 31} for n in range(5)]
    path = mcap(tmp_path / "a.mcap", "json", "arm.State", b"{}", [json.dumps(row).encode() for row in rows])
    with pytest.raises(TraceError, match=r"log_time, position\[pan\], position\[lift\], temperature"):
        open_trace(path)
    trace = open_trace(path, choice=Choice(map={"time": "log_time", "position": "position[{}] in deg"}))
    assert trace.record.joint_names == tuple(NAMES)
    np.testing.assert_allclose(trace.position[2], np.radians([0.2, 0.4]))
    np.testing.assert_allclose(trace.time[1], 0.01, atol=1e-6)


def test_messages_in_protobuf_are_a_table(tmp_path: Path) -> None:
    file = descriptor_pb2.FileDescriptorProto(name="arm.proto", package="arm", syntax="proto3")
    message = file.message_type.add(name="State")
    message.field.add(name="q", number=1, type=1, label=3)
    message.field.add(name="t", number=2, type=1, label=1)
    pool = descriptor_pool.DescriptorPool()
    pool.Add(file)
    kind: Any = message_factory.GetMessageClass(pool.FindMessageTypeByName("arm.State"))
    schema = descriptor_pb2.FileDescriptorSet(file=[file]).SerializeToString()
    raw = [kind(q=[0.1 * n, 0.2 * n], t=0.01 * n).SerializeToString() for n in range(5)]
    path = mcap(tmp_path / "a.mcap", "protobuf", "arm.State", schema, raw)
    trace = open_trace(path, choice=Choice(map={"time": "t", "position": "q[{}]"}))
    np.testing.assert_allclose(trace.position[4], [0.4, 0.8])
    assert trace.time[-1] == pytest.approx(0.04)
    damaged = mcap(tmp_path / "b.mcap", "protobuf", "arm.State", struct.pack("<Q", 2**63 + 7), raw)
    with pytest.raises(TraceError, match="its schema cannot be read"):
        open_trace(damaged, choice=Choice(map={"time": "t", "position": "q[{}]"}))
