"""Decodes ROS messages about joints by ROS's own definitions; type definitions in a bag are never executed."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np

from daq.contracts.trace import Floats

JOINT_STATE = "sensor_msgs/msg/JointState"
CONTROLLER_STATE = "control_msgs/msg/JointTrajectoryControllerState"
DYNAMIC_STATE = "control_msgs/msg/DynamicJointState"
STATES = (JOINT_STATE, CONTROLLER_STATE, DYNAMIC_STATE)
"""Message types that are read, the first in preference to the others."""

_POINTS = "std_msgs/Header header\nstring[] joint_names\n"
_BY_RELEASE = {
    "ros2": ("reference", "feedback", "error", "output"),  # since Iron
    "humble": ("reference", "feedback", "error", "output", "desired", "actual"),
    "old": ("desired", "actual", "error"),  # ROS 1, and ROS 2 up to Galactic
}
"""Fields of a controller's state, by release of control_msgs (https://github.com/ros-controls/control_msgs)."""
_DYNAMIC = (
    "std_msgs/Header header\nstring[] joint_names\ncontrol_msgs/InterfaceValue[] interface_values\n"
    f"{'=' * 80}\nMSG: control_msgs/InterfaceValue\nstring[] interface_names\nfloat64[] values\n"
)


@dataclass(frozen=True)
class JointValues:
    """Joint values in one message, (j,) each; empty where it has none. stamp: ns since 1970."""

    stamp: int
    names: tuple[str, ...]
    position: Floats
    velocity: Floats
    effort: Floats
    set_point: Floats


def decoder(kind: str, ros_1: bool) -> Callable[[bytes], JointValues]:
    """Returns the decoder for messages of one type."""

    def decode(raw: bytes) -> JointValues:
        message, release = _decoded(kind, ros_1, raw)
        stamp = message.header.stamp.sec * 10**9 + message.header.stamp.nanosec
        if kind == JOINT_STATE:
            signals = message.position, message.velocity, message.effort, ()
            return _joint_values(stamp, message.name, signals)
        if kind == DYNAMIC_STATE:
            return _dynamic(stamp, message)
        wanted, there = ("desired", "actual") if release == "old" else ("reference", "feedback")
        asked, measured = getattr(message, wanted), getattr(message, there)
        effort = measured.effort if len(measured.effort) or release == "old" else message.output.effort
        signals = measured.positions, measured.velocities, effort, asked.positions
        return _joint_values(stamp, message.joint_names, signals)

    return decode


def _joint_values(stamp: int, names: Sequence[str], signals: tuple[Sequence[float], ...]) -> JointValues:
    position, velocity, effort, set_point = map(_floats, signals)
    return JointValues(stamp, tuple(names), position, velocity, effort, set_point)


def _floats(values: Sequence[float]) -> Floats:
    return np.array(values, np.float64)


def _dynamic(stamp: int, message: Any) -> JointValues:
    """Returns the joints that have a position; other missing values are NaN."""
    by_joint = [dict(zip(one.interface_names, one.values, strict=False)) for one in message.interface_values]
    named = [(n, values) for n, values in zip(message.joint_names, by_joint, strict=False) if "position" in values]
    signals = [[values.get(name, np.nan) for _, values in named] for name in ("position", "velocity", "effort")]
    return _joint_values(stamp, [name for name, _ in named], (*signals, ()))


def _decoded(kind: str, ros_1: bool, raw: bytes) -> tuple[Any, str]:
    """Returns the message, and the release whose definition fits it. Raises as rosbags does if none fits."""
    releases = tuple(_BY_RELEASE) if kind == CONTROLLER_STATE else ("",)
    for release in releases:
        store = _store(ros_1, kind, release)
        try:
            return (store.deserialize_ros1 if ros_1 else store.deserialize_cdr)(raw, kind), release
        except MemoryError:
            raise
        except Exception:
            if release == releases[-1]:
                raise
    raise AssertionError(kind)


@cache
def _store(ros_1: bool, kind: str, release: str) -> Any:
    from rosbags.typesys import Stores, get_types_from_msg, get_typestore

    store = get_typestore(Stores.ROS1_NOETIC if ros_1 else Stores.ROS2_JAZZY)
    if kind == DYNAMIC_STATE:
        store.register(get_types_from_msg(_DYNAMIC, kind))
    if kind == CONTROLLER_STATE:
        points = _BY_RELEASE[release]
        text = _POINTS + "".join(f"trajectory_msgs/JointTrajectoryPoint {point}\n" for point in points)
        if release != "old":
            several = "".join(f"trajectory_msgs/MultiDOFJointTrajectoryPoint multi_dof_{point}\n" for point in points)
            text += f"string[] multi_dof_joint_names\n{several}"
        store.register(get_types_from_msg(text, kind))
    return store
