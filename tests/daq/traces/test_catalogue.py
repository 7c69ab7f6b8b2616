"""Lists of traces, and finding one of them by what a person types."""

from datetime import timedelta
from functools import partial
from pathlib import Path

import pytest
from mcap.writer import IndexType, Writer

from daq.contracts.errors import TraceError
from daq.contracts.experiment import ExperimentSpec, Sine
from daq.contracts.trace_limits import DEFAULT_TRACE_LIMITS
from daq.traces.catalogue import find_trace, list_traces
from daq.traces.ends import indexed_metadata
from daq.traces.naming import trace_path
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


def test_a_list_changes_with_what_happens_to_a_trace(tmp_path: Path) -> None:
    with TraceWriter(tmp_path / "a.mcap", record(), JOINTS) as writer:
        assert [summary.state for summary in list_traces(tmp_path)] == ["recording"]
        writer.close("complete")
    (tmp_path / "a.mcap").rename(tmp_path / "a.mcap.part")
    assert [summary.state for summary in list_traces(tmp_path)] == ["unfinished"]
    salvage_folder(tmp_path)
    assert [(summary.state, summary.outcome) for summary in list_traces(tmp_path)] == [("finished", "interrupted")]


def test_a_trace_without_its_index_is_listed_only_while_it_is_whole(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
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


@pytest.mark.parametrize(
    ("wanted", "found"),
    [("last", "cc3333"), ("aa", "aa1111"), ("ab2222222222", "ab2222"), ("2026-11-21T06", "ab2222"), ("dd", "dd4444")],
)
def test_a_trace_is_found_by_what_a_person_types(folder: Path, wanted: str, found: str) -> None:
    assert found in find_trace(folder, wanted).name


def test_a_trace_is_found_by_its_path(folder: Path) -> None:
    path = next(folder.glob("*aa1111*"))
    assert find_trace(Path("/nowhere"), str(path)) == path


@pytest.mark.parametrize(
    ("wanted", "complaint"),
    [
        ("a", "2 traces in .* match: .*aa1111.*ab2222.*; give more characters"),
        ("ff", "is not a file, and the folder .* has none"),
        ("", "is not a file, and the folder .* has none"),
    ],
)
def test_what_names_no_trace_or_several_is_one_line(folder: Path, wanted: str, complaint: str) -> None:
    with pytest.raises(TraceError, match=complaint):
        find_trace(folder, wanted)


def test_a_folder_without_traces_has_an_empty_list(tmp_path: Path) -> None:
    assert list_traces(tmp_path) == ()
    with pytest.raises(TraceError, match="has no finished trace yet"):
        find_trace(tmp_path, "last")
    with pytest.raises(TraceError, match="cannot be read: No such file"):
        list_traces(tmp_path / "absent")


def test_a_recording_of_another_program_is_listed_as_no_trace(tmp_path: Path) -> None:
    with (tmp_path / "a.mcap").open("wb") as stream:
        other = Writer(stream)
        other.start("ros2", "rosbag2")
        other.add_metadata("rosbag2", {"a": "b"})
        other.finish()
    (listed,) = list_traces(tmp_path)
    assert listed.state == "unreadable"
    assert listed.problem is not None
    assert listed.problem.endswith("a.mcap: is an MCAP file, but not a trace: it has no metadata 'daq.record'")


def test_a_link_to_itself_is_listed_with_its_problem(tmp_path: Path) -> None:
    link = tmp_path / "x.mcap"
    link.symlink_to(link)
    (listed,) = list_traces(tmp_path)
    assert (listed.state, listed.size) == ("unreadable", 0)
    assert listed.problem == f"{link}: cannot be read: Too many levels of symbolic links"
