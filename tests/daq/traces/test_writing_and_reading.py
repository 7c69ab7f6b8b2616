"""What is recorded is what is read, here and with the official reader."""

import io
from datetime import UTC, datetime
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from mcap.reader import make_reader

from daq.contracts.errors import TraceError
from daq.contracts.sample import SampleRow
from daq.contracts.trace import Trace, TraceEvent
from daq.traces import layout
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


def test_the_joint_schema_describes_the_bytes() -> None:
    kinds = {"float64": "<f8", "int64": "<i8", "int32": "<i4", "uint32": "<u4"}
    lines = [line.split("#")[0].split() for line in layout.schema(layout.JOINT_SCHEMA).decode().splitlines()]
    described = [(name, kinds[kind]) for kind, name in (line for line in lines if line)]
    fields = layout.JOINT_SAMPLE_DTYPE.fields
    assert fields is not None
    assert [(name, fields[name][0].str) for name in fields][1:] == described
    offsets = [fields[name][1] - 4 for name in fields][1:]
    assert all(offset % np.dtype(kind).itemsize == 0 for offset, (_, kind) in zip(offsets, described, strict=True))


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


def test_a_name_tells_moment_and_kind_and_is_never_used_twice(tmp_path: Path) -> None:
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


def test_two_writers_of_one_name_do_not_meet(tmp_path: Path) -> None:
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


def test_a_record_needs_a_time_zone_and_leaves_no_file_without_one(tmp_path: Path) -> None:
    with pytest.raises(TraceError, match="no time zone"):
        TraceWriter(tmp_path / "a.mcap", record(created=datetime(2026, 1, 1)), JOINTS)
    assert list(tmp_path.iterdir()) == []


def test_a_moment_that_no_stamp_can_hold_is_refused() -> None:
    first = Recording(io.BytesIO(), record(created=datetime(1970, 1, 1, tzinfo=UTC)), JOINTS, ("position",), {})
    first.row(row(0, time=0.0))
    with pytest.raises(TraceError, match="is before 1970 or after 2554"):
        first.event(TraceEvent(time=-1e-9, kind="note", message=""))
    last = Recording(io.BytesIO(), record(created=datetime(2261, 1, 1, tzinfo=UTC)), JOINTS, ("position",), {})
    with pytest.raises(TraceError, match="is before 1970 or after 2554"):
        last.event(TraceEvent(time=1e10, kind="note", message=""))


def test_after_the_end_every_sample_counts_as_synced(tmp_path: Path) -> None:
    with TraceWriter(tmp_path / "a.mcap", record(), JOINTS, patience=10) as writer:
        for tick in range(7):
            writer.sample(row(tick))
        writer.close("complete")
    assert writer.synced_samples == 7
