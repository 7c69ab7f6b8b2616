"""What the store does with a trace, and each way in which it may fail."""

import hashlib
from contextlib import nullcontext
from pathlib import Path

import pytest

from daq.contracts.errors import SpecError
from extras.lab.archive.bucket import PIECE, ArchiveError, Content, DamagedError, RefusedError, open_bucket
from tests.extras.lab.archive.store import ACCESS, SECRET, Fault, FaultyStore, ObjectStore, bucket_of, settings_of

TEXT = b"a trace " * 4096


def _file(folder: Path, content: bytes = TEXT) -> Path:
    path = folder / "one.mcap"
    path.write_bytes(content)
    return path


def test_another_client_finds_what_was_sent(store: ObjectStore, tmp_path: Path) -> None:
    name = store.bucket()
    sent = bucket_of(name, store.url).send("ma2000/one.mcap", _file(tmp_path))
    assert sent == Content(len(TEXT), hashlib.sha256(TEXT).hexdigest())
    assert store.objects(name) == {"ma2000/one.mcap": TEXT}


@pytest.mark.parametrize("size", [0, 1, PIECE, PIECE + 1])
def test_every_size_comes_back_as_it_was(store: ObjectStore, tmp_path: Path, size: int) -> None:
    bucket = bucket_of(store.bucket(), store.url, timeout=20)
    content = (b"\x00\x01\x02" * (size // 3 + 1))[:size]
    sent = bucket.send("one", _file(tmp_path, content))
    pieces: list[bytes] = []
    done: list[int] = []
    assert bucket.read("one", size, pieces.append, done.append) == sent
    assert b"".join(pieces) == content
    assert done == sorted(done)
    assert done[-1:] == ([size] if size else [])


@pytest.mark.parametrize(
    ("fault", "kind", "words"),
    [
        ("500", ArchiveError, "the store answers 500"),
        ("503", ArchiveError, "the store answers 503"),
        ("403", RefusedError, "refuses these credentials"),
        ("refuse", ArchiveError, "cannot be reached"),
        ("stall", ArchiveError, "no answer in time"),
    ],
)
def test_an_error_is_one_line_without_secrets(
    store: ObjectStore, proxy: FaultyStore, tmp_path: Path, fault: Fault, kind: type[ArchiveError], words: str
) -> None:
    name = store.bucket()
    proxy.fail(fault)
    patience = {"timeout": 0.2} if fault == "stall" else {}  # every other fault is an answer, which may take its time
    with pytest.raises(kind, match=words) as caught:
        bucket_of(name, proxy.url, **patience).send("one", _file(tmp_path))
    line = str(caught.value)
    assert line.startswith(f"archive {name} at {proxy.url}: keeping a trace: ")
    assert "\n" not in line
    assert ACCESS not in line
    assert SECRET not in line
    assert "ignature" not in line
    assert store.objects(name) == {}


def test_an_error_that_passes_is_not_noticed(store: ObjectStore, proxy: FaultyStore, tmp_path: Path) -> None:
    proxy.fail("503", times=2)
    bucket_of(store.bucket(), proxy.url).send("one", _file(tmp_path))
    assert proxy.seen == ["PUT", "PUT", "PUT"]


@pytest.mark.parametrize("fault", ["cut", "wrong"])
def test_an_answer_that_is_cut_short_is_an_error_and_wrong_bytes_have_another_checksum(
    store: ObjectStore, proxy: FaultyStore, tmp_path: Path, fault: Fault
) -> None:
    bucket = bucket_of(store.bucket(), proxy.url)
    sent = bucket.send("one", _file(tmp_path))
    proxy.fail(fault, "GET")
    with pytest.raises(ArchiveError) if fault == "cut" else nullcontext():
        assert bucket.read("one", len(TEXT), lambda _piece: None) != sent


def test_an_object_that_is_gone_or_shorter_is_damage(store: ObjectStore, tmp_path: Path) -> None:
    name = store.bucket()
    bucket = bucket_of(name, store.url)
    bucket.send("one", _file(tmp_path))
    store.client.put_object(Bucket=name, Key="one", Body=b"short")
    with pytest.raises(DamagedError, match="another size"):
        bucket.read("one", len(TEXT), lambda _piece: None)
    bucket.remove("one")
    bucket.remove("one")
    with pytest.raises(DamagedError, match="no longer has it"):
        bucket.read("one", len(TEXT), lambda _piece: None)


@pytest.mark.parametrize(
    ("name", "address", "kind", "words"),
    [
        ("not-there", None, RefusedError, "there is no such bucket"),
        ("traces", "http://127.0.0.1:9", ArchiveError, "cannot be reached"),
    ],
)
def test_a_bucket_or_a_store_that_is_not_there_is_told(
    store: ObjectStore, tmp_path: Path, name: str, address: str | None, kind: type[ArchiveError], words: str
) -> None:
    with pytest.raises(kind, match=words):
        bucket_of(name, address or store.url).send("one", _file(tmp_path))


def test_without_a_bucket_there_is_no_archive_and_without_credentials_one_line_says_where_they_belong(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    settings = settings_of("traces", "http://127.0.0.1:9")
    assert open_bucket(settings.model_copy(update={"bucket": None})) is None
    monkeypatch.delenv("AWS_ACCESS_KEY_ID", raising=False)
    monkeypatch.setenv("AWS_SECRET_ACCESS_KEY", SECRET)
    with pytest.raises(SpecError, match=r"set AWS_ACCESS_KEY_ID in the environment, or archive\.credentials"):
        open_bucket(settings)
