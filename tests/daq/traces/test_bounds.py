"""What a trace says about itself and what it holds is believed within bounds only, and room is looked for first."""

import json
import shutil
from pathlib import Path

import numpy as np
import pytest

from daq.contracts.errors import TraceError
from daq.contracts.trace import TraceEvent
from daq.contracts.trace_limits import TraceLimits
from daq.traces.bounds import check_record, check_signals, first_short_step
from daq.traces.metadata import extent_of, joints_of, record_of, signals_of
from daq.traces.room import require_room
from tests.daq.traces.samples import record


def test_times_increase_and_one_line_names_the_sample_that_does_not_fit() -> None:
    assert first_short_step(np.array([0.0, 1e-9, 1.0])) is None
    assert first_short_step(np.array([0.0, 1.0, 1.0 + 0.5e-9])) == 2
    assert first_short_step(np.array([0.0, -1.0, -2.0])) == 1
    assert first_short_step(np.array([1.0])) is None
    with pytest.raises(TraceError, match=r"^a: sample 1, column 2: drive = 2e\+09, allowed is ±1e\+09 V, N·m or N$"):
        check_signals({"drive": np.array([[0, 0, 0], [0, 0, 2e9]]), "position": None}, "a")
    with pytest.raises(TraceError, match=r"^a: sample 2: time = 1\.0 s after 1\.0 s, it must increase by at least"):
        check_signals({"time": np.array([0.0, 1.0, 1.0])}, "a")
    check_record(record(), (TraceEvent(time=-4e9, kind="note", message=""),), "a")
    with pytest.raises(TraceError, match="a: event 'note': time = "):
        check_record(record(), (TraceEvent.model_construct(time=5e9, kind="note", message=""),), "a")


def test_a_control_period_lies_between_a_microsecond_and_a_day() -> None:
    for period in (1e-6, 86400.0):
        check_record(record().model_copy(update={"period": period}), (), "a")
    for period in (0.9e-6, 86401.0):
        with pytest.raises(TraceError, match="a: period = "):
            check_record(record().model_copy(update={"period": period}), (), "a")


def test_a_trace_needs_a_folder_with_room_for_its_samples(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    free = 20_000_000 + 1000 * 6 * 400
    usage = type(shutil.disk_usage(tmp_path))
    monkeypatch.setattr(shutil, "disk_usage", lambda _path: usage(10 * free, 9 * free, free))
    require_room(tmp_path / "new" / "folder", 1000, 6)
    assert not list((tmp_path / "new" / "folder").iterdir())
    with pytest.raises(TraceError, match="22 MB are free, this trace may need 22 MB"):
        require_room(tmp_path, 1001, 6)
    (tmp_path / "file").write_text("")
    with pytest.raises(TraceError, match="traces cannot be written there: "):
        require_room(tmp_path / "file" / "folder", 1, 1)


# ---- What a trace says about itself is believed within bounds only, since another program may have written it

LIMITS = TraceLimits(joints=6)
END = {"outcome": "stopped", "counters": '{"retries": 2}', "samples": "7", "duration": "0.12"}


def start(**changes: object) -> dict[str, str]:
    """Metadata at the start, with fields of the record changed."""
    return {"record": json.dumps(json.loads(record().model_dump_json()) | changes)}


def test_outcome_and_counters_come_from_the_end_and_what_is_missing_is_said() -> None:
    assert record_of(start(), None, "a") == record()
    ended = record_of(start(), END, "a")
    assert (ended.outcome, ended.counters) == ("stopped", {"retries": 2})
    assert record_of(start(), END | {"outcome": ""}, "a").outcome is None
    with pytest.raises(TraceError, match="'record' is missing"):
        record_of({}, None, "a")
    with pytest.raises(TraceError, match="'counters' is missing"):
        record_of(start(), {"outcome": ""}, "a")
    for counters in ("[" * 10**5, '{"retries": NaN}', '{"retries": 1e999}'):
        with pytest.raises(TraceError, match="its metadata is not that of a trace"):
            record_of(start(), END | {"counters": counters}, "a")
    with pytest.raises(TraceError, match="'signals' is missing"):
        signals_of({}, "a")
    assert signals_of({"signals": "position drive"}, "a") == {"position", "drive"}


@pytest.mark.parametrize(
    ("changes", "says"),
    [
        ({"trace_id": "../etc"}, "its ID '../etc' must be letters, digits, - and _"),
        ({"trace_id": "a" * 65}, "must be letters, digits, - and _"),
        ({"trace_id": ""}, "must be letters, digits, - and _"),
        ({"created": "2026-01-01T00:00:00"}, "created = 2026-01-01T00:00:00 has no time zone"),
        ({"source": "dream"}, "its metadata is not that of a trace: source: "),
    ],
)
def test_a_record_that_is_none_is_refused_in_one_line(changes: dict[str, object], says: str) -> None:
    with pytest.raises(TraceError) as caught:
        record_of(start(**changes), None, "a")
    assert says in str(caught.value)
    assert "\n" not in str(caught.value)


def test_joints_are_a_list_of_different_numbers_that_keep_their_order() -> None:
    for text in ("1", "3 1 99", "1 2 3 4 5 6", "10  11  12  13  14"):
        assert joints_of({"joints": text}, LIMITS, "a") == tuple(map(int, text.split()))
    for text in ("", "0", "1 1", "100", "01", "1 x", "1 2 3 4 5 6 7", "1 " * 40, "10  11  12  13   14"):
        with pytest.raises(TraceError, match=r"are not 1 to 6 different numbers of joints \(traces.limits.joints\)"):
            joints_of({"joints": text}, LIMITS, "a")


def test_an_extent_is_a_possible_number_of_samples_and_a_time() -> None:
    for samples, duration in (("0", "0.0"), ("7", "0.12"), (str(2**31 - 1), "1e9")):
        assert extent_of({"samples": samples, "duration": duration}, "a") == (int(samples), float(duration))
    for samples, duration in (("-1", "0"), (str(2**31), "0"), ("1", "-0.1"), ("1", "inf"), ("1", "nan"), ("x", "0")):
        with pytest.raises(TraceError, match="its metadata is not that of a trace: "):
            extent_of({"samples": samples, "duration": duration}, "a")
