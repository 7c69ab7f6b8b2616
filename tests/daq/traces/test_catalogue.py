"""Lists of traces, finding one of them by what a person types, and what a list reads of a file."""

from datetime import UTC, datetime, timedelta
from functools import partial
from pathlib import Path

import pytest
from mcap.writer import IndexType, Writer

from daq.contracts.errors import SpecError, TraceError
from daq.contracts.experiment import ExperimentSpec, Sine
from daq.contracts.trace_limits import DEFAULT_TRACE_LIMITS
from daq.traces.catalogue import TraceSummary, find_trace, list_traces
from daq.traces.ends import indexed_metadata
from daq.traces.layout import END_METADATA
from daq.traces.naming import trace_path
from daq.traces.query import parse_query
from daq.traces.salvage import salvage_folder
from daq.traces.scan import UNREADABLE
from daq.traces.writer import TraceWriter
from tests.daq.traces.samples import CREATED, JOINTS, record, row, write


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """Three finished traces, one left by a crash, one that is no trace, and a file that is none of ours."""
    for number, identity in enumerate(("aa1111111111", "ab2222222222", "cc3333333333")):
        made = record(trace_id=identity, created=CREATED + timedelta(hours=number))
        with TraceWriter(trace_path(tmp_path, made), made, JOINTS) as writer:
            for tick in range(10 * (number + 1)):
                writer.sample(row(tick))
            writer.close("stopped" if number == 1 else "complete", {"retries": 2})
    crashed = record(
        trace_id="dd4444444444", created=CREATED - timedelta(days=1), spec=ExperimentSpec(trajectory=Sine())
    )
    path = trace_path(tmp_path, crashed)
    write(path, trace_id="dd4444444444", created=crashed.created, spec=crashed.spec)
    path.rename(path.with_name(path.name + ".part"))
    (tmp_path / "z.mcap").write_bytes(b"not this")
    (tmp_path / "notes.txt").write_text("hello")
    return tmp_path


def test_a_list_tells_what_each_trace_says_about_itself(folder: Path) -> None:
    listed = {summary.trace_id: summary for summary in list_traces(folder)}
    assert list(listed) == [None, "dd4444444444", "aa1111111111", "ab2222222222", "cc3333333333"]
    second = listed["ab2222222222"]
    assert (second.state, second.outcome, second.samples, second.kind) == ("finished", "stopped", 20, "ramp")
    assert second.duration == pytest.approx(0.38)
    assert (second.joints, second.source, second.robot) == (JOINTS, "mock", "ma2000")
    crashed = listed["dd4444444444"]
    assert (crashed.state, crashed.outcome, crashed.samples, crashed.kind) == ("unfinished", None, None, "sine")
    assert (listed[None].state, listed[None].problem) == ("unreadable", f"{folder / 'z.mcap'}: is not an MCAP file")


def test_a_trace_is_listed_with_what_happened_to_it(tmp_path: Path) -> None:
    with TraceWriter(tmp_path / "a.mcap", record(), JOINTS) as writer:
        assert [summary.state for summary in list_traces(tmp_path)] == ["recording"]
        writer.close("complete")
    (tmp_path / "a.mcap").rename(tmp_path / "a.mcap.part")
    assert [summary.state for summary in list_traces(tmp_path)] == ["unfinished"]
    salvage_folder(tmp_path)
    assert [(summary.state, summary.outcome) for summary in list_traces(tmp_path)] == [("finished", "interrupted")]
    (tmp_path / "new").mkdir()
    assert list_traces(tmp_path / "new") == ()
    with pytest.raises(TraceError, match="has no finished trace yet"):
        find_trace(tmp_path / "new", "last")
    with pytest.raises(TraceError, match="cannot be read: No such file"):
        list_traces(tmp_path / "absent")


def test_a_trace_without_its_index_is_listed_while_whole(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = write(tmp_path / "a.mcap", 30)
    data = path.read_bytes()
    path.write_bytes(data[: len(data) - 20])
    (cut,) = list_traces(tmp_path)
    assert (cut.state, cut.trace_id) == ("unreadable", None)
    assert cut.problem.startswith(f"{path}: is damaged after byte ")
    path.unlink()
    kept = ("repeat_channels", "repeat_schemas", "use_statistics", "use_summary_offsets")
    without = partial(Writer, index_types=IndexType.NONE, **dict.fromkeys(kept, False))
    monkeypatch.setattr("daq.traces.recording.Writer", without)
    write(path, 30)
    with path.open("rb") as stream, pytest.raises(UNREADABLE):
        indexed_metadata(stream, DEFAULT_TRACE_LIMITS)
    (whole,) = list_traces(tmp_path)
    assert (whole.state, whole.outcome, whole.samples) == ("finished", "complete", 30)


def test_a_trace_is_found_by_what_a_person_types_or_by_its_path(folder: Path) -> None:
    for wanted, found in (
        ("last", "cc3333"),
        ("aa", "aa1111"),
        ("ab2222222222", "ab2222"),
        ("2026-11-21T06", "ab2222"),
    ):
        assert found in find_trace(folder, wanted).name
    assert "dd4444" in find_trace(folder, "dd").name
    path = next(folder.glob("*aa1111*"))
    assert find_trace(Path("/nowhere"), str(path)) == path
    with pytest.raises(TraceError, match=r"2 traces in .* match: .*aa1111.*ab2222.*; give more characters"):
        find_trace(folder, "a")
    for wanted in ("ff", ""):
        with pytest.raises(TraceError, match=r"is not a file, and the folder .* has no trace with this ID or name"):
            find_trace(folder, wanted)


def test_what_is_no_trace_is_listed_with_its_problem(tmp_path: Path) -> None:
    with (tmp_path / "a.mcap").open("wb") as stream:
        other = Writer(stream)
        other.start("ros2", "rosbag2")
        other.add_metadata("rosbag2", {"a": "b"})
        other.finish()
    (listed,) = list_traces(tmp_path)
    assert listed.state == "unreadable"
    assert listed.problem is not None
    assert listed.problem.endswith("a.mcap: is an MCAP file, but not a trace: it has no metadata 'daq.record'")
    (tmp_path / "a.mcap").unlink()
    link = tmp_path / "x.mcap"
    link.symlink_to(link)
    (listed,) = list_traces(tmp_path)
    assert (listed.state, listed.size) == ("unreadable", 0)
    assert listed.problem == f"{link}: cannot be read: Too many levels of symbolic links"


# ---- Which traces a query means, and which texts are none

RAMP = TraceSummary(
    path=Path("2026-11-01-ramp.mcap"),
    state="finished",
    size=1,
    trace_id="ab12",
    created=datetime(2026, 11, 1, 23, 0, tzinfo=UTC),
    source="mock",
    robot="ma2000",
    kind="ramp",
    outcome="complete",
    notes="after the new belt",
)


@pytest.mark.parametrize(
    ("text", "meant"),
    [
        ("", True),
        ("BELT ab12", True),
        ("belt missing", False),
        ("kind:ramp source:mock outcome:complete robot:ma2000", True),
        ("kind:sweep", False),
        ("since:2026-11-01 until:2026-11-01", True),
        ("until:2026-10-31", False),
        ("since:2026-11-01T23:30", False),
        ("since:2026-11-01T23:30+02:00", True),
        ("12:30", False),
    ],
)
def test_what_is_meant(text: str, meant: bool) -> None:
    assert parse_query(text).matches(RAMP) is meant


def test_what_is_not_known_meets_no_filter() -> None:
    unreadable = TraceSummary(path=Path("x.mcap"), state="unreadable", size=1, problem="is not an MCAP file")
    assert parse_query("").matches(unreadable)
    for text in ("kind:ramp", "since:2020-01-01", "belt"):
        assert not parse_query(text).matches(unreadable)


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("sort:ramp", "unknown term; allowed are kind, source"),
        ("kind:ramp kind:sweep", "kind: is given twice"),
        ("source:dream", "write source: and mock or real or imported"),
        ("kind:", "write kind: and a name"),
        ("since:yesterday", "write a day or a time such as"),
        ("until:9999-12-31", "write a day or a time such as"),
    ],
)
def test_what_is_refused(text: str, says: str) -> None:
    with pytest.raises(SpecError, match=says):
        parse_query(text)


# ---- The beginning and the end of a finished file are found without reading what lies between


@pytest.fixture
def path(tmp_path: Path) -> Path:
    """A finished trace."""
    return write(tmp_path / "a.mcap", notes="warm")


def test_an_index_that_is_missing_or_changed_is_noticed(path: Path) -> None:
    data = path.read_bytes()
    place = data.rindex(END_METADATA.encode())  # in the index, behind the record itself
    path.write_bytes(data[:place] + b"D" + data[place + 1 :])
    with path.open("rb") as stream, pytest.raises(ValueError, match="does not match its checksum"):
        indexed_metadata(stream, DEFAULT_TRACE_LIMITS)
    for kept in (0, 8, 20, 36, len(data) // 2, len(data) - 1):
        path.write_bytes(data[:kept])
        with path.open("rb") as stream, pytest.raises(UNREADABLE):
            indexed_metadata(stream, DEFAULT_TRACE_LIMITS)
