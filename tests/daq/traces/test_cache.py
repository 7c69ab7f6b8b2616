"""The columnar cache: the same trace again, never of another file, never needed."""

import dataclasses
import os
from pathlib import Path

import numpy as np
import pytest

from daq.contracts.trace import Trace
from daq.traces import cache, reader
from daq.traces.reader import read_trace
from tests.daq.traces.samples import write


@pytest.fixture(autouse=True)
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
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = write(tmp_path / "a.mcap")
    first = read_trace(path)
    assert cache.cache_path(path).exists()
    monkeypatch.setattr(reader, "scan", None)
    assert same(read_trace(path), first)


def test_the_cache_of_other_bytes_of_the_same_size_and_time_is_not_used(tmp_path: Path) -> None:
    path, other = write(tmp_path / "a.mcap", notes="one"), write(tmp_path / "b.mcap", notes="two")
    read_trace(path)
    before = path.stat()
    path.write_bytes(other.read_bytes())
    os.utime(path, ns=(before.st_atime_ns, before.st_mtime_ns))
    assert path.stat().st_size == before.st_size
    assert read_trace(path).record.notes == "two"


@pytest.mark.parametrize("damage", [b"", b"PK\x03\x04 rubbish", None], ids=["empty", "rubbish", "half"])
def test_a_damaged_cache_is_made_again(tmp_path: Path, damage: bytes | None) -> None:
    path = write(tmp_path / "a.mcap")
    first = read_trace(path)
    stored = cache.cache_path(path)
    good = stored.read_bytes()
    stored.write_bytes(good[: len(good) // 2] if damage is None else damage)
    assert same(read_trace(path), first)
    assert len(stored.read_bytes()) == len(good)


def test_a_changed_bit_in_a_cached_column_is_noticed(tmp_path: Path) -> None:
    path = write(tmp_path / "a.mcap")
    first = read_trace(path)
    stored = cache.cache_path(path)
    changed = bytearray(stored.read_bytes())
    value = first.position[50].tobytes()
    changed[changed.index(value)] ^= 1
    stored.write_bytes(changed)
    assert same(read_trace(path), first)


def test_an_unfinished_trace_has_no_cache(tmp_path: Path) -> None:
    path = write(tmp_path / "a.mcap")
    part = path.rename(tmp_path / "a.mcap.part")
    read_trace(part)
    assert not (tmp_path / cache.FOLDER).exists()
