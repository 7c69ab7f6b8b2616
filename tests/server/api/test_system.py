"""What the service says about itself when its disk cannot be written, and to whom."""

import asyncio
import errno
import os
import shutil
import sqlite3
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NoReturn

import httpx
import pytest
from sqlalchemy import event
from sqlalchemy.exc import OperationalError

from server.clock import SystemClock
from server.services import KEPT_FOR, Readiness
from server.store.engine import Store
from tests.server.clocks import HandClock
from tests.server.inside import service_inside

STRANGER = {"X-Forwarded-For": "10.0.0.9"}


@pytest.fixture
def api(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[httpx.Client]:
    """Of a service that is not connected."""
    with service_inside(tmp_path, SystemClock(), monkeypatch) as client:
        yield client


def _read_only(**_: object) -> NoReturn:
    raise OSError(errno.EROFS, os.strerror(errno.EROFS), "/the/folder")


def test_a_disk_that_cannot_be_written_is_not_ready_and_only_who_may_see_the_robot_is_told_why(
    api: httpx.Client, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("server.services.KEPT_FOR", 0.0)
    address = api.base_url.join("/readyz")
    healthy = {"database": "", "traces": "", "room": "", "robot ma2000": ""}
    assert api.get(address).json()["checks"].items() >= healthy.items()
    assert sorted(path.suffix for path in (tmp_path / "traces").iterdir()) == []
    monkeypatch.setattr(tempfile, "TemporaryFile", _read_only)
    told = api.get(address)
    assert told.status_code == 503
    for name in ("database", "traces"):
        assert "Read-only file system" in told.json()["checks"][name]
    stranger = api.get(address, headers=STRANGER)
    assert stranger.status_code == 503
    checks = stranger.json()["checks"]
    assert {checks["database"], checks["traces"]} == {"not well: details need a token"}
    assert "/the/folder" not in stranger.text


def test_readiness_is_looked_at_once_for_all_who_ask_and_again_after_a_second() -> None:
    clock = HandClock()
    looks: list[int] = []
    readiness = Readiness(clock)

    def look() -> dict[str, str]:
        looks.append(len(looks))
        return {"looks": str(len(looks))}

    async def ask() -> None:
        for _ in range(2):
            told = await asyncio.gather(*(readiness.check(look) for _ in range(20)))
            assert {one["looks"] for one in told} == {"1"}
        clock.turn(KEPT_FOR)
        assert (await readiness.check(look))["looks"] == "2"

    asyncio.run(ask())


def test_a_database_that_can_be_read_and_not_written_is_noticed(tmp_path: Path) -> None:
    path = tmp_path / "service.sqlite"
    store = Store(f"sqlite:///{path}")
    event.listen(store.engine, "connect", lambda connection, _: connection.execute("PRAGMA busy_timeout=1"))
    store.migrate()
    store.require_writable()
    other = sqlite3.connect(path, isolation_level=None)
    other.execute("BEGIN IMMEDIATE")
    with pytest.raises(OperationalError, match="locked"):
        store.require_writable()
    other.close()
    store.close()


def test_a_folder_of_traces_that_is_away_is_told_and_takes_no_experiment(api: httpx.Client, tmp_path: Path) -> None:
    """Both were a fault of the program, 500: the disk is away, and that is what has to be said."""
    folder = tmp_path / "traces"
    folder.rename(tmp_path / "elsewhere")
    system = api.base_url.join("/api/v1/system")
    answer = api.post("experiments", json={"spec": {}})
    assert answer.status_code == 503, answer.text
    assert answer.json()["type"] == "/api/v1/problems#traces-away"
    assert str(folder) in answer.json()["detail"]
    found = api.get(system).json()  # the page learns from it where it can stop
    assert found["storage"]["traces_free"] == 0
    assert str(folder) in found["warnings"][0]
    (tmp_path / "elsewhere").rename(folder)
    assert api.get(system).json()["storage"]["traces_free"] > 0
    assert api.get("queue/experiments").json() == []


def test_a_calibration_is_checked_and_queued_as_any_experiment(
    api: httpx.Client, monkeypatch: pytest.MonkeyPatch
) -> None:
    def asked(**options: Any) -> httpx.Response:
        return api.post("calibrations/gain", **({"json": {"joints": [1]}} | options))

    refused = asked(json={"joints": [9]})
    assert refused.status_code == 422, refused.text
    first = asked(headers={"Idempotency-Key": "1"})
    assert first.status_code == 201, first.text
    assert first.headers["Location"].endswith(f"/experiments/{first.json()['id']}")
    again = asked(headers={"Idempotency-Key": "1"})
    assert (again.status_code, again.json()["id"]) == (200, first.json()["id"])
    full = shutil._ntuple_diskusage(10**9, 10**9 - 10**6, 10**6)  # type: ignore[attr-defined]
    monkeypatch.setattr(shutil, "disk_usage", lambda _path: full)
    assert asked().json()["type"] == "/api/v1/problems#no-room"
    assert [one["id"] for one in api.get("queue/experiments").json()] == [first.json()["id"]]


def test_the_size_of_the_database_counts_what_was_written_last(api: httpx.Client, tmp_path: Path) -> None:
    for _ in range(20):
        api.post("/experiments", json={}).raise_for_status()  # SQLite writes them to its log first
    log = tmp_path / "service" / "service.sqlite-wal"
    assert log.stat().st_size > 0
    told = api.get(api.base_url.join("/api/v1/system")).json()["storage"]["database_size"]
    assert told >= log.stat().st_size
