"""Traces between the folder and the archive: none is ever lost, whatever the store does."""

import hashlib
from collections.abc import Callable, Iterator
from contextlib import closing
from datetime import timedelta
from pathlib import Path
from typing import Any

import pytest

from server.problems import ProblemError
from server.store.models import ModelStore
from server.store.tables import ModelRow
from tests.extras.lab.archive.bench import ROBOT, Bench
from tests.extras.lab.archive.store import ACCESS, SECRET, Fault, FaultyStore, ObjectStore

Make = Callable[..., Bench]
UNREADABLE = Path("/proc/self/mem")
"""A regular file whose first byte nobody can read, not even root: nothing lies at address 0."""


@pytest.fixture
def make(tmp_path: Path) -> Iterator[Make]:
    """Makes benches, and closes them."""
    made: list[Bench] = []

    def make(bucket: str, url: str, **settings: Any) -> Bench:
        made.append(Bench(tmp_path, bucket, url, **settings))
        return made[-1]

    yield make
    for bench in made:
        bench.close()


@pytest.fixture
def bench(store: ObjectStore, proxy: FaultyStore, make: Make) -> Bench:
    """A bench whose store may fail; nothing is dropped by itself."""
    return make(store.bucket(), proxy.url)


def _model_of(bench: Bench, trace: str) -> ModelStore:
    models = ModelStore(bench.store)
    now = bench.clock.utc()
    row = ModelRow(id="a" * 12, robot=ROBOT, name="rig b", file="a.json", created=now, created_by="anna")
    models.insert(row, [trace])
    return models


def _drop(bench: Bench, trace: str) -> bytes:
    """Has a trace archived and its local copy dropped; what the file was."""
    content = bench.path(trace).read_bytes()
    bench.nobody_reads()
    bench.service.send_and_drop(trace, drop=True)
    bench.until(lambda: not bench.path(trace).exists())
    return content


@pytest.fixture
def dropped(bench: Bench) -> tuple[str, bytes]:
    """A trace that only the archive has, and what its file was."""
    trace = bench.trace()
    bench.service.start()
    return trace, _drop(bench, trace)


def test_a_trace_is_sent_when_it_is_in_the_catalogue(bench: Bench, store: ObjectStore) -> None:
    before = bench.trace()
    bench.service.start()
    after = bench.trace()
    bench.until_archived(before, after)
    for trace in (before, after):
        found, content = bench.archive_index.get(trace), bench.path(trace).read_bytes()
        assert found is not None
        assert store.objects(bench.service.status().place.split()[0])[found.object] == content
        assert found.sha256 == hashlib.sha256(content).hexdigest()
        entry = bench.traces.get(ROBOT, trace)
        assert (entry.archived, entry.local, entry.missing) == (True, True, False)
    assert bench.told == []


def test_a_dropped_trace_is_fetched_when_it_is_opened(bench: Bench, dropped: tuple[str, bytes]) -> None:
    trace, content = dropped
    entry = bench.traces.get(ROBOT, trace)
    assert (entry.archived, entry.local, entry.missing) == (True, False, False)
    with pytest.raises(ProblemError) as caught:
        bench.catalogue.path_of(trace)
    assert (caught.value.status, caught.value.kind) == (503, "trace-in-archive")
    bench.until(lambda: bench.traces.get(ROBOT, trace).local)  # the file is there a moment earlier
    assert bench.service.of(trace).local
    assert bench.catalogue.path_of(trace).read_bytes() == content
    assert [one.name for one in bench.catalogue.folder.iterdir()] == [bench.path(trace).name]


def test_a_start_after_a_drop_keeps_the_trace_and_sends_nothing_twice(
    bench: Bench, dropped: tuple[str, bytes], make: Make, proxy: FaultyStore
) -> None:
    trace, _ = dropped
    bench.close()
    proxy.seen.clear()
    again = make(bench.service.status().place.split()[0], proxy.url)
    again.catalogue.bring_up_to_date()
    again.service.start()
    again.until(lambda: again.service.status().archived == 1)
    assert again.catalogue.place_of(trace) == bench.path(trace)
    assert "PUT" not in proxy.seen


@pytest.mark.parametrize("fault", ["500", "403", "refuse", "cut", "wrong"])
def test_a_local_copy_stays_while_the_store_fails_and_goes_when_it_is_back(
    bench: Bench, proxy: FaultyStore, fault: Fault
) -> None:
    trace = bench.trace()
    content = bench.path(trace).read_bytes()
    proxy.fail(fault)
    bench.nobody_reads()
    bench.service.send_and_drop(trace, drop=True)
    bench.service.start()
    bench.until(lambda: len(bench.counted) >= 2)
    status = bench.service.status()
    assert (status.state, status.waiting) == ("refused" if fault == "403" else "away", 1)
    assert status.problem.startswith("archive traces-")
    assert ACCESS not in status.problem
    assert SECRET not in status.problem
    assert bench.archive_index.get(trace) is None
    assert bench.path(trace).read_bytes() == content
    assert any("1 traces wait to be sent" in line for line in bench.service.warnings(0.9))
    proxy.fail("")
    bench.until(lambda: not bench.path(trace).exists())
    assert bench.service.status().state == "ok"
    assert bench.service.warnings(0.9) == []
    assert bench.told[-1].endswith("answers again")


@pytest.mark.parametrize("fault", ["500", "refuse", "cut"])
def test_a_fetch_waits_until_the_store_is_back(
    bench: Bench, dropped: tuple[str, bytes], proxy: FaultyStore, fault: Fault
) -> None:
    trace, content = dropped
    proxy.fail(fault)
    bench.service.fetch(trace)
    bench.until(lambda: ("fetch", "failed", 0) in bench.counted)
    transfer = bench.service.of(trace).transfer
    assert transfer is not None
    assert transfer.state != "failed"
    assert not bench.path(trace).exists()
    proxy.fail("")
    bench.until(lambda: bench.service.of(trace).local)
    assert bench.path(trace).read_bytes() == content


@pytest.mark.parametrize("times", [1, None], ids=["once", "always"])
def test_wrong_bytes_never_become_a_trace(
    bench: Bench, dropped: tuple[str, bytes], proxy: FaultyStore, times: int | None
) -> None:
    trace, content = dropped
    proxy.fail("wrong", "GET", times=times)
    bench.service.fetch(trace)
    if times is None:
        bench.until(lambda: ("fetch", "failed", 0) in bench.counted)
        transfer = bench.service.of(trace).transfer
        assert transfer is not None
        assert (transfer.state, transfer.problem[-30:]) == (
            "failed",
            "differs from the file that was sent (SHA-256)"[-30:],
        )
        assert list(bench.catalogue.folder.iterdir()) == []
        assert bench.service.fetch(trace).kind == "archive"
        proxy.fail("")
        assert bench.service.fetch(trace).kind == "trace-in-archive"
    bench.until(lambda: bench.service.of(trace).local)
    assert bench.path(trace).read_bytes() == content


@pytest.mark.parametrize("changes", ["the object is damaged", "the file is changed"])
def test_a_local_copy_goes_only_when_the_archive_has_these_very_bytes(
    bench: Bench, store: ObjectStore, changes: str
) -> None:
    trace = bench.trace()
    bench.service.start()
    bench.until_archived(trace)
    found, content = bench.archive_index.get(trace), bench.path(trace).read_bytes()
    assert found is not None
    bucket = bench.service.status().place.split()[0]
    if changes == "the file is changed":
        content += b"more"
        bench.path(trace).write_bytes(content)
    else:
        store.client.put_object(Bucket=bucket, Key=found.object, Body=bytes(len(content)))
        bench.clock.ahead = timedelta(hours=2)
    bench.nobody_reads()
    bench.service.send_and_drop(trace, drop=True)
    bench.until(lambda: not bench.path(trace).exists())  # not before it was sent again
    assert content in store.objects(bucket).values()
    told = any("the local copy stays, and is sent again" in line for line in bench.told)
    assert told is (changes == "the object is damaged")


def test_old_copies_go_unless_they_are_used_opened_or_not_yet_archived(store: ObjectStore, make: Make) -> None:
    with closing(make(store.bucket(), store.url, keep_days=30)) as bench:
        old, used, opened = bench.trace(), bench.trace(), bench.trace()
        _model_of(bench, used)
        bench.nobody_reads()
        bench.catalogue.path_of(opened)
        bench.clock.ahead = timedelta(days=31)
        bench.service.start()
        bench.until(lambda: not bench.path(old).exists())
        bench.until_archived(used, opened)
    assert bench.path(used).exists()
    assert bench.path(opened).exists()


def test_the_oldest_copies_go_when_all_take_too_much(store: ObjectStore, make: Make) -> None:
    bench = make(store.bucket(), store.url, keep_size=0, keep_used=False)
    first, second = bench.trace(), bench.trace()
    models = _model_of(bench, second)
    bench.nobody_reads()
    bench.service.start()
    bench.until(lambda: not bench.path(first).exists() and not bench.path(second).exists())
    with pytest.raises(ProblemError, match="is used by model 'rig b'"):
        bench.catalogue.remove(second)
    models.remove(ROBOT, "a" * 12, lambda _file: None)
    bench.catalogue.remove(second)


def test_a_limit_that_cannot_be_kept_is_told(store: ObjectStore, make: Make) -> None:
    bench = make(store.bucket(), store.url, keep_size=0)
    used = bench.trace()
    _model_of(bench, used)
    bench.nobody_reads()
    bench.service.start()
    bench.until(lambda: any("no more can be dropped" in line for line in bench.service.warnings(0.9)))
    (line,) = bench.service.warnings(0.9)
    assert line.startswith("local traces take 0 of 0 MB (archive.keep_size), and no more can be dropped: models and")
    assert bench.path(used).exists()


def test_a_deleted_trace_is_deleted_in_the_archive_even_if_that_is_away(
    bench: Bench, store: ObjectStore, proxy: FaultyStore
) -> None:
    trace, kept = bench.trace(), bench.trace()
    bench.service.start()
    bench.until_archived(trace, kept)
    proxy.fail("503")
    bench.catalogue.remove(trace)
    bucket = bench.service.status().place.split()[0]
    bench.until(lambda: bench.service.status().state == "away")
    assert len(store.objects(bucket)) == 2
    proxy.fail("")
    bench.until(lambda: len(store.objects(bucket)) == 1)
    assert bench.archive_index.get(kept) is not None


def test_a_trace_of_the_archive_is_not_uploaded_a_second_time_and_without_an_archive_it_says_so(
    bench: Bench, dropped: tuple[str, bytes]
) -> None:
    trace, content = dropped
    other = bench.catalogue.folder / "other_name.mcap"
    other.write_bytes(content)
    assert bench.catalogue.add(other) is None
    bench.catalogue.archive = None
    with pytest.raises(ProblemError) as caught:
        bench.catalogue.path_of(trace)
    assert caught.value.kind == "no-archive"


def test_an_object_that_cannot_be_deleted_is_told_and_the_others_are_sent(
    bench: Bench, store: ObjectStore, proxy: FaultyStore
) -> None:
    gone = bench.trace()
    bench.service.start()
    bench.until_archived(gone)
    proxy.fail("403", "DELETE", "POST")  # several are deleted by one POST
    bench.catalogue.remove(gone)
    bench.until(lambda: bench.service.status().state != "ok")
    bench.until_archived(bench.trace())
    bench.until(lambda: any(f"(trace {gone})" in line for line in bench.service.warnings(0.9)))
    assert bench.service.status().state == "ok"
    told = len(bench.told)
    bench.until_archived(bench.trace())
    assert len(bench.told) == told
    proxy.fail("")
    bench.service.deleted()
    bench.until(lambda: bench.archive_index.to_delete(ROBOT) == [])
    assert len(store.objects(bench.service.status().place.split()[0])) == 2
    bench.until(lambda: bench.service.warnings(0.9) == [])


def test_a_file_that_cannot_be_read_is_told_and_the_other_copies_go(
    bench: Bench, make: Make, proxy: FaultyStore
) -> None:
    bad, good = bench.trace(), bench.trace()
    bench.service.start()
    bench.until_archived(bad, good)
    bench.close()
    again = make(bench.service.status().place.split()[0], proxy.url, keep_days=30)
    path = again.path(bad)
    path.unlink()
    path.symlink_to(UNREADABLE)
    again.clock.ahead = timedelta(days=31)
    again.service.start()
    again.until(lambda: not again.path(good).exists())
    again.until(lambda: again.service.warnings(0.9) != [])
    (line,) = again.service.warnings(0.9)
    assert line.startswith(f"{path.name}: cannot be dropped: ")


@pytest.mark.parametrize("direction", ["send", "fetch"])
def test_a_trace_that_always_fails_holds_up_no_other(bench: Bench, proxy: FaultyStore, direction: str) -> None:
    bad, good = bench.trace(), bench.trace()
    digest = hashlib.sha256(bench.path(bad).read_bytes()).hexdigest()[:16]
    if direction == "send":
        proxy.fail("500", "PUT", only=digest)
        bench.service.start()
        bench.until_archived(good)
        assert bench.archive_index.get(bad) is None
        bench.until(lambda: any(f"(trace {bad})" in line for line in bench.service.warnings(0.9)))
        proxy.fail("")
        bench.service.deleted()  # wakes it: it would look again after some minutes
        bench.until_archived(bad)
        return
    bench.service.start()
    _drop(bench, bad)
    _drop(bench, good)
    proxy.fail("500", "GET", "HEAD", only=digest)
    bench.service.fetch(bad)
    bench.service.fetch(good)
    bench.until(lambda: bench.service.of(good).local)
    proxy.fail("")
    bench.until(lambda: bench.service.of(bad).local)


def test_what_failed_for_want_of_room_before_somebody_asked_is_fetched_again(
    bench: Bench, dropped: tuple[str, bytes], monkeypatch: pytest.MonkeyPatch
) -> None:
    trace, _ = dropped
    full = bench.clock.monotonic()
    with monkeypatch.context() as disk:
        disk.setattr("extras.lab.archive.service.RESERVE", 1 << 60)
        bench.service.fetch_now(trace)
        bench.until(lambda: bench.counted.count(("fetch", "failed", 0)) == 1)
        transfer = bench.service.of(trace).transfer
        assert transfer is not None
        assert "MB are free, fetching needs" in transfer.problem
        assert bench.service.bring([trace], full).state == "failed"
        bench.service.fetch_now(trace)
        bench.until(lambda: bench.counted.count(("fetch", "failed", 0)) == 2)
        bench.clock.turned = 3600.0
        assert bench.service.bring([trace], bench.clock.monotonic()).state == "waiting"
        bench.until(lambda: bench.counted.count(("fetch", "failed", 0)) == 3)
        bench.clock.turned = 7200.0
    assert bench.service.fetch(trace).kind == "trace-in-archive"
    bench.until(lambda: bench.service.of(trace).local)
