"""Disks that fail: one clear error, and what came before is safe; and the columnar cache, never needed."""

import dataclasses
import os
import resource
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest

from daq.contracts.errors import TraceError
from daq.contracts.trace import Trace
from daq.traces import cache, disk, reader
from daq.traces.naming import part_path
from daq.traces.reader import read_trace
from daq.traces.salvage import salvage
from daq.traces.store import write_trace
from daq.traces.writer import TraceWriter
from tests.daq.traces.samples import JOINTS, record, row, write


@contextmanager
def largest_file(size: int) -> Iterator[None]:
    """While it lasts no file of this process grows beyond `size` bytes: the system refuses, as with a full disk."""
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))


def test_a_full_disk_is_an_error_of_the_next_call_and_what_was_synced_is_safe(tmp_path: Path) -> None:
    path = tmp_path / "a.mcap"
    taken = 0

    def record_for_ever() -> None:
        nonlocal taken
        for taken in range(100_000):
            writer.sample(row(taken))

    with largest_file(60_000):
        writer = TraceWriter(path, record(), JOINTS, sync_interval=0.0, patience=60)
        with pytest.raises(TraceError, match=r"a\.mcap: cannot be written: File too large; what came before is in "):
            record_for_ever()
        assert writer.failure is not None
        with pytest.raises(TraceError, match="File too large"):
            writer.close("complete")
    assert not path.exists()
    assert 0 < writer.synced_samples <= taken
    salvaged = salvage(part_path(path))
    assert salvaged.samples >= writer.synced_samples
    np.testing.assert_array_equal(read_trace(path).tick, np.arange(salvaged.samples))


def test_a_disk_that_is_full_from_the_start_or_a_folder_that_is_not_there_leaves_no_file(tmp_path: Path) -> None:
    with largest_file(100), pytest.raises(TraceError, match="cannot be written: File too large"):
        TraceWriter(tmp_path / "a.mcap", record(), JOINTS)
    assert list(tmp_path.iterdir()) == []
    with pytest.raises(TraceError, match=r"absent/a\.mcap: cannot be made: No such file or directory"):
        TraceWriter(tmp_path / "absent" / "a.mcap", record(), JOINTS)


def test_a_disk_that_is_full_when_a_trace_is_salvaged_or_imported_changes_nothing(tmp_path: Path) -> None:
    part = tmp_path / "a.mcap.part"
    data = write(tmp_path / "b.mcap", 500).read_bytes()
    part.write_bytes(data)
    trace = read_trace(tmp_path / "b.mcap")
    with largest_file(10_000):
        with pytest.raises(TraceError, match="cannot be salvaged: File too large; it is unchanged"):
            salvage(part)
        with pytest.raises(TraceError, match="cannot be written: File too large"):
            write_trace(trace, tmp_path / "c.mcap")
    assert part.read_bytes() == data
    assert {entry.name for entry in tmp_path.iterdir()} == {"a.mcap.part", "b.mcap"}


def test_a_disk_that_falls_behind_is_an_error_and_loses_nothing_that_was_taken(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    stalled, go_on = threading.Event(), threading.Event()
    sync = disk.sync

    def stall(stream: object) -> None:
        if threading.current_thread() is not threading.main_thread():
            stalled.set()
            assert go_on.wait(60)
        sync(stream)  # type: ignore[arg-type]

    monkeypatch.setattr(disk, "sync", stall)
    writer = TraceWriter(tmp_path / "a.mcap", record(), JOINTS, sync_interval=0.0, queue_length=20)
    writer.sample(row(0))
    assert stalled.wait(60)
    for tick in range(1, 21):
        writer.sample(row(tick))
    with pytest.raises(TraceError, match="the disk is 20 samples and events behind"):
        writer.sample(row(21))
    go_on.set()
    with pytest.raises(TraceError, match="20 samples and events behind"):
        writer.close("complete")
    assert salvage(part_path(tmp_path / "a.mcap")).samples == 21


def test_a_patient_recording_waits_for_the_disk_instead(tmp_path: Path) -> None:
    with TraceWriter(tmp_path / "a.mcap", record(), JOINTS, queue_length=1, patience=60) as writer:
        for tick in range(300):
            writer.sample(row(tick))
        writer.close("complete")
    assert len(read_trace(tmp_path / "a.mcap")) == 300


def test_a_patient_recording_hears_of_a_disk_that_fails(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The queue is full when the disk fails: what waits in it is refused, so that there is room for the next row."""
    stalled, fails = threading.Event(), threading.Event()
    sync = disk.sync

    def fail(stream: object) -> None:
        if threading.current_thread() is threading.main_thread():
            return sync(stream)  # type: ignore[arg-type]
        stalled.set()
        assert fails.wait(60)
        raise OSError(5, "Input/output error")

    monkeypatch.setattr(disk, "sync", fail)
    writer = TraceWriter(tmp_path / "a.mcap", record(), JOINTS, sync_interval=0.0, queue_length=20, patience=600)
    writer.sample(row(0))
    assert stalled.wait(60)
    for tick in range(1, 21):
        writer.sample(row(tick))
    fails.set()

    told: list[str] = []

    def record_on() -> None:
        try:
            for tick in range(21, 100):
                writer.sample(row(tick))
        except TraceError as error:
            told.append(str(error))

    recording = threading.Thread(target=record_on, daemon=True)
    recording.start()
    recording.join(60)
    assert not recording.is_alive(), "it waits for room until its patience ends"
    assert len(told) == 1
    assert "cannot be written: Input/output error" in told[0]
    with pytest.raises(TraceError, match="Input/output error"):
        writer.close("complete")
    assert part_path(tmp_path / "a.mcap").exists()


def refuse(*_args: object, **_options: object) -> None:
    raise PermissionError(13, "Permission denied")


# ---- The columnar cache: the same trace again, never of another file, never needed


@pytest.fixture
def always_worth_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(cache, "WORTH_IT", 0)


def same(a: Trace, b: Trace) -> bool:
    """Whether two traces agree to the bit."""
    for field in dataclasses.fields(Trace):
        left, right = getattr(a, field.name), getattr(b, field.name)
        if isinstance(left, np.ndarray):
            if left.dtype != right.dtype or not np.array_equal(left, right):
                return False
        elif left != right:
            return False
    return True


def test_the_second_opening_comes_from_the_cache_and_is_the_same(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, always_worth_it: None
) -> None:
    path = write(tmp_path / "a.mcap")
    first = read_trace(path)
    assert cache.cache_path(path).exists()
    monkeypatch.setattr(reader, "scan", None)
    assert same(read_trace(path), first)


def test_a_cache_of_other_bytes_or_with_a_changed_bit_is_not_used(tmp_path: Path, always_worth_it: None) -> None:
    path, other = write(tmp_path / "a.mcap", notes="one"), write(tmp_path / "b.mcap", notes="two")
    read_trace(path)
    before = path.stat()
    path.write_bytes(other.read_bytes())
    os.utime(path, ns=(before.st_atime_ns, before.st_mtime_ns))
    assert path.stat().st_size == before.st_size
    assert read_trace(path).record.notes == "two"
    path = write(tmp_path / "c.mcap")
    first = read_trace(path)
    stored = cache.cache_path(path)
    changed = bytearray(stored.read_bytes())
    value = first.position[50].tobytes()
    changed[changed.index(value)] ^= 1
    stored.write_bytes(changed)
    assert same(read_trace(path), first)


@pytest.mark.parametrize("damage", [b"", b"PK\x03\x04 rubbish", None], ids=["empty", "rubbish", "half"])
def test_a_damaged_cache_is_made_again(tmp_path: Path, damage: bytes | None, always_worth_it: None) -> None:
    path = write(tmp_path / "a.mcap")
    first = read_trace(path)
    stored = cache.cache_path(path)
    good = stored.read_bytes()
    stored.write_bytes(good[: len(good) // 2] if damage is None else damage)
    assert same(read_trace(path), first)
    assert len(stored.read_bytes()) == len(good)


def test_an_unfinished_trace_has_no_cache_nor_has_one_of_which_none_can_be_made(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, always_worth_it: None
) -> None:
    path = write(tmp_path / "a.mcap")
    part = path.rename(tmp_path / "a.mcap.part")
    read_trace(part)
    assert not (tmp_path / cache.FOLDER).exists()
    part.rename(path)
    monkeypatch.setattr(Path, "mkdir", refuse)
    assert len(read_trace(path)) == 100
    assert [entry.name for entry in tmp_path.iterdir()] == ["a.mcap"]
