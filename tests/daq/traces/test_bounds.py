"""Values that no rig can have measured are refused; the largest possible ones are not. And room is looked for first."""

import shutil
from pathlib import Path

import numpy as np
import pytest

from daq.contracts.errors import TraceError
from daq.contracts.trace import TraceEvent
from daq.traces.bounds import check_record, check_signals, first_outside, first_short_step
from daq.traces.room import require_room
from tests.daq.traces.samples import record

LARGEST = {
    "time": 4e9,
    "host_time": 4e9,
    "tick": 2.0**53,
    "position": 1e9,
    "set_point": 1e9,
    "error": 2e9,
    "velocity": 1e6,
    "drive": 1e9,
}


@pytest.mark.parametrize("name", LARGEST)
def test_the_largest_value_of_either_sign_passes_and_the_next_does_not(name: str) -> None:
    largest = LARGEST[name]
    assert first_outside(name, np.array([[-largest, 0.0], [0.0, largest]])) is None
    beyond = np.nextafter(largest, np.inf)
    assert first_outside(name, np.array([[0.0, 0.0], [0.0, beyond]])) == (1, 1)
    assert first_outside(name, np.array([0.0, -beyond, np.nan])) == (1,)
    assert first_outside(name, np.array([0.0, np.nan])) == (1,)


def test_times_are_at_least_a_nanosecond_apart() -> None:
    assert first_short_step(np.array([0.0, 1e-9, 1.0])) is None
    assert first_short_step(np.array([0.0, 1.0, 1.0 + 0.5e-9])) == 2
    assert first_short_step(np.array([0.0, -1.0, -2.0])) == 1
    assert first_short_step(np.array([1.0])) is None


def test_one_line_names_the_sample_and_the_signal() -> None:
    with pytest.raises(TraceError, match=r"^a: sample 1, column 2: drive = 2e\+09, allowed is ±1e\+09 V, N·m or N$"):
        check_signals({"drive": np.array([[0, 0, 0], [0, 0, 2e9]]), "position": None}, "a")
    with pytest.raises(TraceError, match=r"^a: sample 2: time = 1\.0 s after 1\.0 s, it must increase by at least"):
        check_signals({"time": np.array([0.0, 1.0, 1.0])}, "a")


@pytest.mark.parametrize(("period", "allowed"), [(1e-6, True), (86400.0, True), (0.9e-6, False), (86401.0, False)])
def test_a_control_period_lies_between_a_microsecond_and_a_day(period: float, allowed: bool) -> None:
    made = record().model_copy(update={"period": period})
    if allowed:
        check_record(made, (), "a")
    else:
        with pytest.raises(TraceError, match="a: period = "):
            check_record(made, (), "a")


def test_an_event_has_a_possible_time() -> None:
    check_record(record(), (TraceEvent(time=-4e9, kind="note", message=""),), "a")
    with pytest.raises(TraceError, match="a: event 'note': time = "):
        check_record(record(), (TraceEvent.model_construct(time=5e9, kind="note", message=""),), "a")


def test_a_trace_needs_room_for_its_samples_and_leaves_some(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    free = 20_000_000 + 1000 * 6 * 400
    usage = type(shutil.disk_usage(tmp_path))
    monkeypatch.setattr(shutil, "disk_usage", lambda _path: usage(10 * free, 9 * free, free))
    require_room(tmp_path / "new" / "folder", 1000, 6)
    assert not list((tmp_path / "new" / "folder").iterdir())
    with pytest.raises(TraceError, match="22 MB are free, this trace may need 22 MB"):
        require_room(tmp_path, 1001, 6)


def test_a_folder_that_cannot_be_made_is_one_line(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(TraceError, match="traces cannot be written there: "):
        require_room(tmp_path / "file" / "folder", 1, 1)
