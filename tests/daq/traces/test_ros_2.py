"""The library rosbags, which is not of this project, opens a trace as it is and finds in it what was recorded."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from mcap.reader import make_reader
from rosbags.highlevel import AnyReader
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from daq.contracts.trace import EventKind, TraceEvent
from daq.traces import cdr, layout
from daq.traces.writer import TraceWriter
from tests.daq.traces.samples import CREATED, JOINTS, PERIOD, record, row, write

SAMPLES = 50


def messages(path: Path) -> dict[str, list[Any]]:
    """Every message of a bag by its topic, decoded by the definitions that the bag holds, and encoded again."""
    found: dict[str, list[Any]] = {}
    with AnyReader([path]) as reader:
        for connection, _, raw in reader.messages():
            message: Any = reader.deserialize(raw, connection.msgtype)
            assert bytes(reader.typestore.serialize_cdr(message, connection.msgtype)) == raw
            found.setdefault(connection.topic, []).append(message)
    return found


def test_every_message_decodes_by_its_own_definition_and_encodes_to_the_same_bytes(tmp_path: Path) -> None:
    found = messages(write(tmp_path / "a.mcap", SAMPLES))
    assert {topic: len(each) for topic, each in found.items()} == {
        "/joint_states": SAMPLES,
        **{f"/samples/joint_{joint}": SAMPLES for joint in JOINTS},
        "/events": 2,
        "/rosout": 2,
    }
    state = found["/joint_states"][7]
    assert state.name == ["waist", "shoulder", "elbow"]
    np.testing.assert_array_equal(state.position, row(7).position)
    assert (len(state.velocity), len(state.effort)) == (0, 0)
    moment = layout.nanoseconds(CREATED) + round(7 * PERIOD * 1e9)
    assert state.header.stamp.sec * 10**9 + state.header.stamp.nanosec == moment
    sample = found["/samples/joint_3"][7]
    assert (sample.tick, sample.set_point, sample.power_raw) == (7, row(7).set_point[2], row(7).power_raw[2])
    assert (found["/events"][0].kind, list(found["/events"][0].tick), list(found["/events"][1].tick)) == (
        "start",
        [0],
        [],
    )
    assert (found["/rosout"][1].name, found["/rosout"][1].msg) == ("end", "done: 21.6° reached")


def test_a_record_of_a_slow_line_tells_when_set_points_were_taken_and_is_of_ros_2_as_a_whole(tmp_path: Path) -> None:
    with TraceWriter(tmp_path / "a.mcap", record(every=4), JOINTS) as writer:
        for tick in (0, 4, 8):
            writer.sample(row(tick, taken=max(0, tick - 2)))
        writer.close("complete")
    found = messages(tmp_path / "a.mcap")
    assert [(one.tick, one.taken) for one in found["/set_points"]] == [(0, 0), (4, 2), (8, 6)]
    assert [one.tick for one in found["/samples/joint_1"]] == [0, 4, 8]


def test_what_ros_2_prints_about_a_trace_is_what_the_page_says(tmp_path: Path) -> None:
    """`ros2 bag info` prints the counts of the index, in lines of this form."""
    with write(tmp_path / "a.mcap", 200).open("rb") as stream:
        summary = make_reader(stream).get_summary()
    assert summary is not None
    assert summary.statistics is not None
    counts = summary.statistics.channel_message_counts
    lines = sorted(
        f"Topic: {one.topic} | Type: {summary.schemas[one.schema_id].name} | Count: {counts[number]} | "
        f"Serialization Format: {one.message_encoding}"
        for number, one in summary.channels.items()
    )
    page = Path(__file__).parents[3].joinpath("docs", "traces.md").read_text("utf-8")
    assert [line[19:] for line in page.splitlines() if "Topic: /" in line] == lines
    assert f"Messages:          {summary.statistics.message_count}\n" in page


@pytest.mark.parametrize("velocity", [False, True])
@pytest.mark.parametrize("unit", ["V", "N·m"])
@pytest.mark.parametrize("joints", [1, 2, 6])
def test_joint_states_have_velocity_and_effort_where_they_were_measured(
    tmp_path: Path, joints: int, unit: str, velocity: bool
) -> None:
    speeds = tuple(0.5 * joint for joint in range(joints)) if velocity else ()
    numbers = tuple(range(1, joints + 1))
    with TraceWriter(tmp_path / "a.mcap", record(drive_unit=unit), numbers) as writer:
        writer.sample(row(4, joints, velocity=speeds))
        writer.close("complete")
    (state,) = messages(tmp_path / "a.mcap")["/joint_states"]
    assert tuple(state.position) == row(4, joints).position
    assert tuple(state.velocity) == speeds
    assert tuple(state.effort) == (row(4, joints).drive if unit == "N·m" else ())


@pytest.mark.parametrize("name", [layout.JOINT_STATES_SCHEMA, layout.LOG_SCHEMA])
def test_a_definition_of_ros_is_the_one_that_ros_has(name: str) -> None:
    """By the hash over types and names of all fields that ROS 2 compares (REP 2016)."""
    ours, theirs = get_typestore(Stores.EMPTY), get_typestore(Stores.ROS2_JAZZY)
    ours.register(get_types_from_msg(layout.schema(name).decode(), name))
    assert ours.hash_rihs01(name) == theirs.hash_rihs01(name)


@pytest.mark.parametrize(
    ("kind", "level"), [("start", 20), ("note", 20), ("pause", 30), ("stop", 30), ("fault", 40), ("link_lost", 40)]
)
def test_the_log_says_how_bad_an_event_is(tmp_path: Path, kind: EventKind, level: int) -> None:
    with TraceWriter(tmp_path / "a.mcap", record(), JOINTS) as writer:
        writer.event(TraceEvent(time=1.5, kind=kind, message="why", tick=75, joint=2))
        writer.close("complete")
    (entry,) = messages(tmp_path / "a.mcap")["/rosout"]
    assert (entry.level, entry.INFO, entry.WARN, entry.ERROR) == (level, 20, 30, 40)


def test_a_stamp_of_ros_2_stays_at_the_last_second_that_it_can_name() -> None:
    assert cdr.stamp(1_000_000_001_500_000_000) == (1_000_000_001, 500_000_000)
    assert cdr.stamp(2**31 * 10**9 - 1) == (2**31 - 1, 999_999_999)
    assert cdr.stamp(9_000_000_000 * 10**9) == (2**31 - 1, 999_999_999)


@pytest.mark.parametrize(
    ("change", "complaint"),
    [
        (lambda data: data[:-1], "longer than its message"),
        (lambda data: data + b"\0", "1 bytes after its last field"),
        (lambda data: b"\0\0" + data[2:], "not plain CDR"),
        (lambda data: data[:20] + b"\xff\xff\xff\xff" + data[24:], "longer than its message"),
        (lambda data: data.replace(b"limit\0", b"limit."), "a text has no end"),
        (lambda data: data.replace(b"limit\0", b"lim\xfft\0"), "can't decode"),
        (lambda data: data.replace(b"limit\0", b"limot\0"), "kind"),
        (lambda data: data[:40] + b"\2" + data[41:], "at most one number has 2"),
        (lambda data: data[:3], "not plain CDR"),
    ],
)
def test_an_event_that_is_none_is_refused(change: Any, complaint: str) -> None:
    event = TraceEvent(time=1.5, kind="limit", message="", tick=75, joint=2)
    message = cdr.event_message(event, 10**18)
    assert cdr.event_of(message) == event
    with pytest.raises(ValueError, match=complaint):
        cdr.event_of(change(message))
