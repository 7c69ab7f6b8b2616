"""What verify finds in traces that are right and in traces with one thing wrong, and what is missing from a record."""

from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from mcap.reader import make_reader
from mcap.writer import Writer

from daq.contracts.errors import TraceError
from daq.contracts.labels import Outcome
from daq.contracts.trace import TraceEvent
from daq.runner.recorder import Recorder
from daq.traces import layout
from daq.traces.reader import read_trace
from daq.traces.salvage import salvage
from daq.traces.store import write_trace
from daq.traces.verify import verify
from daq.traces.writer import TraceWriter
from tests.daq.quiet import Quiet
from tests.daq.traces.samples import JOINTS, record, row, write


def findings(path: Path) -> dict[tuple[str, str], str]:
    """Messages by level and check, notes left out."""
    return {(f.level, f.check): f.message for f in verify(path).findings if f.level != "note"}


def recorded(
    path: Path,
    ticks: list[int],
    outcome: Outcome = "complete",
    counters: dict[str, float] | None = None,
    event: TraceEvent | None = None,
    every: int = 1,
    **changes: object,
) -> Path:
    """A trace whose last row has `changes`."""
    with TraceWriter(path, record(every=every), JOINTS) as writer:
        for tick in ticks:
            writer.sample(row(tick, **(changes if tick == ticks[-1] else {})))
        if event:
            writer.event(event)
        return writer.close(outcome, counters)


def test_what_is_right_has_no_findings_but_notes(tmp_path: Path) -> None:
    verification = verify(write(tmp_path / "a.mcap"))
    assert verification.trustworthy
    assert [(f.level, f.check) for f in verification.findings] == [("note", "arrival")]
    made = recorded(tmp_path / "c.mcap", [0, 1, 4], counters={"missing_samples": 2})
    assert set(findings(made)) == {("warning", "gaps")}
    more = recorded(tmp_path / "b.mcap", [0, 1, 4], counters={"missing_samples": 3})
    assert set(findings(more)) == {("warning", "gaps")}, "it may have lost some before the first and after the last"


@pytest.mark.parametrize(
    ("made", "expected", "words"),
    [
        ({"ticks": [0, 1, 4, 5, 9]}, ("warning", "gaps"), "5 samples are missing in 2 gaps, the first after 0.020 s"),
        ({"ticks": [0, 2, 6]}, ("warning", "gaps"), "4 samples are missing in 2 gaps, the first after 0.000 s"),
        (
            {"ticks": [0, 1, 4], "counters": {"missing_samples": 1}},
            ("error", "counters"),
            "2 samples are missing, the link counted 1",
        ),
        ({"ticks": [0, 1, 2], "time": 0.045}, ("error", "time"), "time is 0.25 periods off the tick at sample 2"),
        ({"ticks": [0, 1], "error": (0.01, 0.02, 0.05)}, ("error", "error"), "joint 3: error is not set point"),
        ({"ticks": [0, 1], "outcome": "fault"}, ("warning", "outcome"), "the run ended as 'fault'"),
        (
            {"ticks": [0, 1], "event": TraceEvent(time=0.01, kind="link_lost", message="")},
            ("error", "events"),
            "claims to be complete, but has events link_lost",
        ),
        ({"ticks": []}, ("warning", "samples"), "has no samples"),
        (
            {"ticks": [0, 2, 4], "every": 2, "taken": 5},
            ("error", "set_points"),
            "the set points of tick 4 are recorded as used from tick 5",
        ),
    ],
)
def test_what_is_wrong_is_found(tmp_path: Path, made: dict[str, object], expected: tuple[str, str], words: str) -> None:
    found = findings(recorded(tmp_path / "a.mcap", **made))  # type: ignore[arg-type]
    assert found[expected].startswith(words)


def test_a_deviation_within_rounding_is_no_finding_and_a_little_more_is(tmp_path: Path) -> None:
    count = 4.71238898038469 / 4096
    good = row(1).error
    near = (good[0] + 0.9 * count, *good[1:])
    assert findings(recorded(tmp_path / "a.mcap", [0, 1], error=near)) == {}
    far = (good[0] + 2 * count, *good[1:])
    assert "worst 2.0 counts at 0.020 s" in findings(recorded(tmp_path / "b.mcap", [0, 1], error=far))["error", "error"]
    assert findings(recorded(tmp_path / "c.mcap", [0, 1, 2], time=0.04 + 0.009 * 0.02)) == {}
    found = findings(recorded(tmp_path / "d.mcap", [0, 1, 2], time=0.04 + 0.011 * 0.02))
    assert found["error", "time"].startswith("time is 0.011 periods off the tick at sample 2")


def test_a_tick_that_comes_twice_and_an_event_beyond_the_record_are_named(tmp_path: Path) -> None:
    # Another program may write such a file; ours refuses the sample
    trace = read_trace(write(tmp_path / "a.mcap", 4))
    path = write_trace(replace(trace, tick=np.array([0, 1, 1, 2])), tmp_path / "b.mcap")
    assert findings(path)["error", "ticks"] == "tick 1 follows 1"
    late = TraceEvent(time=1.0, kind="note", message="")
    notes = [f for f in verify(recorded(tmp_path / "c.mcap", [0, 1], event=late)).findings if f.check == "events"]
    assert [(f.level, f.message) for f in notes] == [
        ("note", "1 events lie outside the record, the first 'note' at 1.000 s")
    ]


def test_an_index_that_is_missing_is_told_and_one_of_other_chunks_is_an_error(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    finish = Writer.finish

    def with_one_more(writer: Writer) -> None:
        writer._Writer__statistics.chunk_count += 1
        finish(writer)

    monkeypatch.setattr(Writer, "finish", with_one_more)
    found = findings(recorded(tmp_path / "a.mcap", [0, 1]))
    assert found["error", "index"] == "the index names 2 chunks, the file has 1"
    monkeypatch.setattr("daq.traces.recording.Writer", partial(Writer, use_statistics=False))
    assert findings(recorded(tmp_path / "b.mcap", [0, 1])) == {
        ("warning", "index"): "has no index: other tools open it slowly"
    }


def test_damage_is_an_error_and_an_unfinished_trace_a_warning(tmp_path: Path) -> None:
    path = write(tmp_path / "a.mcap")
    data = bytearray(path.read_bytes())
    data[len(data) // 2] ^= 1
    (tmp_path / "b.mcap").write_bytes(data)
    assert not verify(tmp_path / "b.mcap").trustworthy
    assert "file" in dict.fromkeys(check for level, check in findings(tmp_path / "b.mcap") if level == "error")
    part = path.rename(tmp_path / "a.mcap.part")
    whole = part.read_bytes()
    part.write_bytes(whole[: whole.index(b"daq.outcome")])
    assert {("warning", "file"), ("warning", "outcome")} <= set(findings(part))
    salvage(part)
    assert set(findings(path)) == {("warning", "outcome")}
    (tmp_path / "c.mcap").write_bytes(b"")
    assert findings(tmp_path / "c.mcap")["error", "trace"].endswith("is empty")
    with pytest.raises(TraceError, match="cannot be read"):
        verify(tmp_path / "absent.mcap")


def noted(path: Path, check: str) -> list[str]:
    return [f.message for f in verify(path).findings if (f.level, f.check) == ("note", check)]


def test_what_is_noted_of_events_sensors_and_arrival(tmp_path: Path) -> None:
    for number, (time, outside) in enumerate([(0.0, 0), (0.04, 0), (0.0401, 1), (-0.001, 1)]):
        event = TraceEvent(time=time, kind="note", message="")
        path = recorded(tmp_path / f"event{number}.mcap", [0, 1], event=event)
        assert len(noted(path, "events")) == outside, "the record lasts until the end of its last period"
    # Samples arrive 0, 0.3 or 0.6 ms after their ticks; one in 201 comes half a second late, and does not count.
    path = recorded(tmp_path / "late.mcap", list(range(201)), host_time=5000.0 + 4.0 + 0.5)
    assert noted(path, "arrival") == ["arrival jitter: 0.60 ms (1st to 99th percentile)"]
    with TraceWriter(tmp_path / "a.mcap", record(machine=None), JOINTS) as writer:
        writer.sample(row(0, error=(9.0, 9.0, 9.0)))
        path = writer.close("complete")
    assert noted(path, "error") == [
        f"joint {joint}: its sensor is unknown, so error = set point − position was not checked" for joint in JOINTS
    ]
    assert verify(path).trustworthy


# ---- A record of a slow line tells from which control period on the set points of each sample were used

TAKEN = (0, *range(2, 38, 4))


@pytest.fixture
def slow(tmp_path: Path) -> Path:
    """A record of every fourth period; of the first sample nothing is known."""
    path = tmp_path / "slow.mcap"
    with TraceWriter(path, record(every=4), JOINTS) as writer:
        for tick, taken in zip(range(0, 40, 4), TAKEN, strict=True):
            writer.sample(row(tick, taken=taken))
        writer.close("complete")
    return path


def test_set_points_taken_read_back_and_a_fast_line_shows_them_itself(slow: Path, tmp_path: Path) -> None:
    trace = read_trace(slow)
    again = read_trace(write_trace(trace, tmp_path / "again.mcap"))
    for each in (trace, again):
        np.testing.assert_array_equal(each.taken, TAKEN)  # type: ignore[arg-type]
    path = write(tmp_path / "fast.mcap")
    assert read_trace(path).taken is None
    with path.open("rb") as stream:
        assert layout.SET_POINTS_TOPIC not in {channel.topic for _, channel, _ in make_reader(stream).iter_messages()}


# ---- What is missing from a trace is counted in samples, by the trace as by the recorder that makes it.


@pytest.mark.parametrize(
    ("every", "ticks", "missing"),
    [
        (1, [7], 0),
        (1, [0, 1, 4], 2),
        (3, [0, 3, 6], 0),
        (3, [0, 3, 7, 10], 0),
        (3, [0, 3, 8, 11], 1),
        (3, [0, 3, 9, 12], 1),
        (3, [0, 4, 8, 12], 1),
        (20, [0, 22, 41, 69, 81], 0),
        (20, list(range(0, 2900, 29)), 45),
        (20, [0, 10, 50], 1),
        (20, [0, 30, 50, 99], 2),
        (3, [0, 3, 4, 7, 10, 16], 1),
    ],
    ids=str,
)
def test_missing_samples(tmp_path: Path, every: int, ticks: list[int], missing: int) -> None:
    with TraceWriter(tmp_path / "a.mcap", record(every=every), JOINTS, patience=10) as writer:
        recorder = Recorder(writer, JOINTS, Quiet(), every)
        for tick in ticks:
            recorder.row(row(tick))
        path = writer.close("complete", {})
    assert (recorder.missing, read_trace(path).missing) == (missing, missing)
