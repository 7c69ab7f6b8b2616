"""A bag that needs more than its limits ends a process of its own; a damaged one is told in one line."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from rosbags.rosbag1 import Writer as Writer1
from rosbags.rosbag2 import CompressionFormat, CompressionMode
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
from tests.extras.formats.bags.test_bags_that_lack_something import mcap
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


def _read_bag(path: Path) -> Trace:
    return import_bag(path, LIMITS, Choice(drive_unit="N·m"))


def kinds(folder: Path) -> list[Kind]:
    """A sound bag of every kind, each in a folder of its own."""
    found = []
    moving: list[dict[str, Any]] = [{"velocity": [0.1, 0.2]}] * ROWS
    makers: tuple[tuple[str, Callable[[Path], Path], str], ...] = (
        ("bag of ROS 1", lambda place: bag(place / "a.bag", moving, "ros1"), ""),
        ("bag of MCAP", lambda place: mcap(place / "a.mcap", ROWS), ""),
        ("bag of SQLite", lambda place: bag(place / "a", moving, "sqlite3"), "a.db3"),
        ("metadata of a bag", lambda place: bag(place / "a", moving, "sqlite3"), "metadata.yaml"),
    )
    for name, make, inside in makers:
        (folder / name).mkdir()
        made = make(folder / name)
        changed = made / inside if inside else made
        found.append(Kind(name, made, changed, _read_bag, changed.read_bytes()))
    return found


@pytest.mark.parametrize("cases", [200, pytest.param(CASES // 3, marks=[pytest.mark.slow, pytest.mark.timeout(3600)])])
def test_damaged_bags_are_refused_in_one_line_or_read_as_a_whole(tmp_path: Path, cases: int) -> None:
    tally = campaign(cases, 2, kinds(tmp_path))
    assert not tally.faults, "\n".join(tally.examples)
    assert tally.ends["read"] > cases // 10
