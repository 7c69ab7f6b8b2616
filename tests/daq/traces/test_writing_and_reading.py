"""What is recorded is what is read, here, with the official reader, and with a library of ROS 2."""

import io
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from mcap.reader import make_reader
from rosbags.highlevel import AnyReader
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from daq.contracts.errors import TraceError
from daq.contracts.sample import SampleRow
from daq.contracts.trace import EventKind, Trace, TraceEvent
from daq.traces import cdr, layout
from daq.traces.naming import new_trace_id, part_path, trace_path
from daq.traces.reader import read_trace
from daq.traces.recording import Recording
from daq.traces.store import write_trace
from daq.traces.writer import TraceWriter
from tests.daq.traces.samples import CREATED, JOINTS, PERIOD, record, row, write

number = st.floats(allow_nan=False, allow_infinity=False, width=64, min_value=-1e6, max_value=1e6)


@st.composite
def recordings(draw: st.DrawFn) -> tuple[tuple[int, ...], list[SampleRow]]:
    joints = tuple(sorted(draw(st.sets(st.integers(1, 6), min_size=1))))
    ticks = sorted(draw(st.sets(st.integers(0, 2**32 - 1), max_size=30)))
    values = st.tuples(*[number for _ in joints])
    powers = st.tuples(*[st.integers(-(2**31), 2**31 - 1) for _ in joints])
    rows = [
        SampleRow(
            tick,
            tick * PERIOD,
            draw(number),
            draw(values),
            draw(values),
            draw(values),
            draw(values),
            draw(powers),
            draw(st.integers(0, 2**32 - 1)),
        )
        for tick in ticks
    ]
    return joints, rows


@settings(max_examples=40, deadline=None)
@given(recordings())
def test_a_recording_reads_back_to_the_bit(
    tmp_path_factory: pytest.TempPathFactory, recording: tuple[tuple[int, ...], list[SampleRow]]
) -> None:
    joints, rows = recording
    path = tmp_path_factory.mktemp("traces") / "a.mcap"
    with TraceWriter(path, record(), joints) as writer:
        for sample in rows:
            writer.sample(sample)
        writer.close("complete")
    trace = read_trace(path)
    assert trace.joints == joints
    for name in ("set_point", "position", "error", "drive", "power_raw"):
        expected = np.array([getattr(sample, name) for sample in rows]).reshape(-1, len(joints))
        np.testing.assert_array_equal(getattr(trace, name), expected)
    for name in ("tick", "time", "host_time", "status"):
        np.testing.assert_array_equal(getattr(trace, name), [getattr(sample, name) for sample in rows])


def test_the_record_the_outcome_and_the_events_read_back(tmp_path: Path) -> None:
    trace = read_trace(write(tmp_path / "a.mcap", notes="two\nlines, 21.6°", operator="A"))
    expected = {"outcome": "complete", "counters": {"missing_samples": 0, "retries": 3}}
    assert trace.record == record(notes="two\nlines, 21.6°", operator="A").model_copy(update=expected)
    assert trace.events == (
        TraceEvent(time=0.0, kind="start", message="recording starts", tick=0),
        TraceEvent(time=2.0, kind="end", message="done: 21.6° reached"),
    )
    assert not part_path(tmp_path / "a.mcap").exists()


def test_the_official_reader_finds_topics_schemas_messages_and_attachments(tmp_path: Path) -> None:
    path = tmp_path / "a.mcap"
    with TraceWriter(path, record(), JOINTS, attachments={"config.toml": b"port = 'mock://'\n"}) as writer:
        for tick in range(60):
            writer.sample(row(tick))
        writer.event(TraceEvent(time=0.5, kind="ramp_start", message="21.6° in 0.65 s"))
        writer.close("complete")
    with path.open("rb") as stream:
        reader = make_reader(stream, validate_crcs=True)
        summary = reader.get_summary()
        messages = list(reader.iter_messages())
        assert [attachment.data for attachment in reader.iter_attachments()] == [b"port = 'mock://'\n"]
        assert [metadata.name for metadata in reader.iter_metadata()] == ["daq.record", "daq.outcome"]
    assert summary is not None
    schemas = {channel.topic: summary.schemas[channel.schema_id].name for channel in summary.channels.values()}
    assert schemas == {
        "/joint_states": "sensor_msgs/msg/JointState",
        "/events": "ma2000_daq/msg/Event",
        "/rosout": "rcl_interfaces/msg/Log",
        **{f"/samples/joint_{joint}": "ma2000_daq/msg/JointSample" for joint in JOINTS},
    }
    assert len(messages) == 60 * 4 + 2


def test_logged_times_follow_the_monotonic_clock_and_published_times_the_board(tmp_path: Path) -> None:
    path = tmp_path / "a.mcap"
    with TraceWriter(path, record(), (1,)) as writer:
        for tick in (10, 11, 12):
            writer.sample(row(tick, 1, host_time=77.0 + tick * 0.02 + (0.005 if tick == 11 else 0)))
        writer.close("complete")
    start = layout.nanoseconds(CREATED)
    with path.open("rb") as stream:
        times = [
            (m.publish_time - start, m.log_time - start)
            for _, _, m in make_reader(stream).iter_messages("/samples/joint_1")
        ]
    assert times == [(200_000_000, 200_000_000), (220_000_000, 225_000_000), (240_000_000, 240_000_000)]


@settings(max_examples=30, deadline=None)
@given(st.data())
def test_a_trace_written_at_once_reads_back_with_the_signals_it_has(
    tmp_path_factory: pytest.TempPathFactory, data: st.DataObject
) -> None:
    count, joints = data.draw(st.integers(0, 12)), data.draw(st.sampled_from([(1,), (2, 5), (1, 2, 3, 4, 5, 6)]))
    columns = st.lists(st.lists(number, min_size=len(joints), max_size=len(joints)), min_size=count, max_size=count)
    signals = data.draw(st.sets(st.sampled_from(["set_point", "error", "drive", "velocity"])))
    given_signals = {name: np.array(data.draw(columns)).reshape(count, len(joints)) for name in sorted(signals)}
    position = np.array(data.draw(columns)).reshape(count, len(joints))
    trace = Trace(record(source="imported"), joints, np.arange(count) * 0.01, position, **given_signals)  # type: ignore[arg-type]
    back = read_trace(write_trace(trace, tmp_path_factory.mktemp("traces") / "a.mcap"))
    assert back.record == trace.record
    np.testing.assert_array_equal(back.time, trace.time)
    np.testing.assert_array_equal(back.position, trace.position)
    for name in ("set_point", "error", "drive", "velocity", "power_raw", "tick"):
        there, expected = getattr(back, name), given_signals.get(name)
        assert (there is None) == (expected is None)
        if expected is not None:
            np.testing.assert_array_equal(there, expected)


def test_a_name_is_never_used_twice_and_writers_of_one_do_not_meet(tmp_path: Path) -> None:
    # A name tells moment and kind and is never used twice
    path = trace_path(tmp_path, record())
    assert path.name == "2026-11-21T05-14-42Z_ramp_ab12cd.mcap"
    write(path)
    before = path.read_bytes()
    with pytest.raises(TraceError, match="exists already"):
        TraceWriter(path, record(), JOINTS)
    with pytest.raises(TraceError, match="exists already"):
        write_trace(read_trace(path), path)
    assert path.read_bytes() == before
    numbers = {new_trace_id() for _ in range(100)}
    assert len(numbers) == 100
    assert all(len(number) == 12 and set(number) <= set("0123456789abcdef") for number in numbers)
    # Two writers of one name do not meet
    with TraceWriter(tmp_path / "a.mcap", record(), JOINTS) as writer:
        with pytest.raises(TraceError, match=r"a\.mcap\.part: exists already"):
            TraceWriter(tmp_path / "a.mcap", record(), JOINTS)
        writer.sample(row(0))
        writer.close("complete")
    assert len(read_trace(tmp_path / "a.mcap")) == 1


@pytest.mark.parametrize(
    ("changes", "complaint"),
    [
        ({"position": (1.0, float("nan"), 1.0)}, "tick 6 has a value that is not finite"),
        ({"host_time": float("inf")}, "tick 6 has a value that is not finite"),
        ({"drive": (1.0, 2.0)}, "tick 6 does not have 3 values"),
        ({"tick": 5}, "tick 5 came after tick 5"),
        ({"time": 0.1}, "tick 6 came after tick 5"),
    ],
)
def test_a_row_that_could_not_be_read_back_is_refused_and_the_others_stay(
    tmp_path: Path, changes: dict[str, object], complaint: str
) -> None:
    with TraceWriter(tmp_path / "a.mcap", record(), JOINTS) as writer:
        writer.sample(row(5))
        with pytest.raises(TraceError, match=complaint):
            writer.sample(row(6, **changes))
        writer.close("fault")
    trace = read_trace(tmp_path / "a.mcap")
    assert (len(trace), trace.record.outcome) == (1, "fault")


def test_leaving_without_a_close_is_an_interruption_and_keeps_the_first_error(tmp_path: Path) -> None:
    writer = TraceWriter(tmp_path / "a.mcap", record(), JOINTS)

    def record_and_fail() -> None:
        with writer:
            writer.sample(row(0))
            raise KeyError("first")

    with pytest.raises(KeyError, match="first"):
        record_and_fail()
    assert read_trace(tmp_path / "a.mcap").record.outcome == "interrupted"
    with pytest.raises(TraceError, match="is closed already"):
        writer.sample(row(1))
    with TraceWriter(tmp_path / "b.mcap", record(), JOINTS, patience=10) as writer:
        for tick in range(7):
            writer.sample(row(tick))
        writer.close("complete")
    assert writer.synced_samples == 7


def test_a_moment_without_time_zone_or_stamp_is_refused_and_leaves_no_file(tmp_path: Path) -> None:
    with pytest.raises(TraceError, match="no time zone"):
        TraceWriter(tmp_path / "a.mcap", record(created=datetime(2026, 1, 1)), JOINTS)
    assert list(tmp_path.iterdir()) == []
    first = Recording(io.BytesIO(), record(created=datetime(1970, 1, 1, tzinfo=UTC)), JOINTS, ("position",), {})
    first.row(row(0, time=0.0))
    with pytest.raises(TraceError, match="is before 1970 or after 2554"):
        first.event(TraceEvent(time=-1e-9, kind="note", message=""))
    last = Recording(io.BytesIO(), record(created=datetime(2261, 1, 1, tzinfo=UTC)), JOINTS, ("position",), {})
    with pytest.raises(TraceError, match="is before 1970 or after 2554"):
        last.event(TraceEvent(time=1e10, kind="note", message=""))


# ---- The library rosbags, which is not of this project

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


def test_a_stamp_of_after_2038_is_the_last_that_ros_2_has() -> None:
    assert cdr.stamp(1_000_000_001_500_000_000) == (1_000_000_001, 500_000_000)
    assert cdr.stamp(2**31 * 10**9 - 1) == (2**31 - 1, 999_999_999)
    assert cdr.stamp(9_000_000_000 * 10**9) == (2**31 - 1, 999_999_999)
