"""A clock that is set back, a disk or a database that cannot be written: in a service inside the tests' process."""

import asyncio
import errno
import os
import shutil
import sqlite3
import tempfile
from collections.abc import Iterator
from contextlib import closing
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any, NoReturn

import httpx
import pytest
from sqlalchemy.exc import OperationalError

from server.api import upload
from server.api.upload import Uploads
from server.bounded.messages import Order
from server.catalogue.catalogue import Catalogue
from server.services import KEPT_FOR, Readiness
from server.store.waiting_events import EventStore
from tests.server.clocks import HandClock
from tests.server.inside import WrongClock, service_inside
from tests.server.polling import until

SHORT = {"trajectory": {"kind": "pause", "duration": 0.1}, "joints": [1], "settle": 0, "hold": 0}
TABLE = "time,position_1\n" + "\n".join(f"{0.02 * n:.2f},{0.001 * n}" for n in range(50))


@pytest.fixture
def clock() -> WrongClock:
    """Right, until it is set."""
    return WrongClock()


@pytest.fixture
def api(tmp_path: Path, clock: WrongClock, monkeypatch: pytest.MonkeyPatch) -> Iterator[httpx.Client]:
    """Of a service with that clock, which is not connected."""
    with service_inside(tmp_path, clock, monkeypatch) as client:
        yield client


def _submit(api: httpx.Client, **more: Any) -> str:
    answer = api.post("experiments", json={"spec": SHORT} | more)
    assert answer.status_code == 201, answer.text
    number: str = answer.json()["id"]
    return number


def _listed(api: httpx.Client, path: str) -> list[dict[str, Any]]:
    items: list[dict[str, Any]] = api.get(path).json()["items"]
    return items


@pytest.mark.timeout(300)
def test_a_clock_that_is_set_back_while_experiments_wait_reorders_and_loses_nothing(
    api: httpx.Client, clock: WrongClock
) -> None:
    api.post("queue/pause")
    made = [_submit(api), _submit(api)]
    clock.ahead = timedelta(days=-3)
    made += [_submit(api), _submit(api)]
    assert [one["id"] for one in api.get("queue/experiments").json()] == made
    assert [one["id"] for one in _listed(api, "experiments")] == made[::-1]
    assert api.post("connect").status_code == 200
    api.post("queue/resume", json={})
    for number in made:
        ended = until(api, f"experiments/{number}", lambda one: one["state"] not in ("queued", "running"), {"wait": 10})
        assert ended["state"] == "done"
    started = [one["experiment"] for one in _listed(api, "events?limit=200") if one["text"] == "started"]
    assert started == made[::-1]  # the newest first
    assert {one["experiment"] for one in _listed(api, "traces")} == set(made)
    assert api.post("disconnect").status_code == 200


def test_what_waits_for_a_moment_waits_longer_when_the_clock_is_set_back(api: httpx.Client, clock: WrongClock) -> None:
    in_a_minute = datetime.now(UTC) + timedelta(minutes=1)
    later = _submit(api, at=in_a_minute.isoformat())
    schedule = api.post("schedules", json={"spec": SHORT, "every": 3600}).json()
    runs = until(api, f"experiments?schedule={schedule['id']}", lambda found: found["items"])["items"]
    clock.ahead = timedelta(days=-1)
    assert api.get(f"experiments/{later}").json()["state"] == "queued"
    clock.ahead = timedelta(hours=2)
    until(api, "queue", lambda queue: queue["waiting_for"] != "")  # what was due waits for the robot, and is not lost
    assert {one["id"] for one in api.get("queue/experiments").json()} >= {later, runs[0]["id"]}
    assert len(_listed(api, f"experiments?schedule={schedule['id']}")) == 1  # the run before still waits


def _full(_path: object) -> Any:
    return shutil._ntuple_diskusage(10**9, 10**9 - 10**6, 10**6)  # type: ignore[attr-defined]


def test_a_full_disk_refuses_new_experiments_and_says_so(api: httpx.Client, monkeypatch: pytest.MonkeyPatch) -> None:
    waiting = api.post("experiments", json={"spec": SHORT}, headers={"Idempotency-Key": "1"}).json()["id"]
    monkeypatch.setattr(shutil, "disk_usage", _full)
    again = api.post("experiments", json={"spec": SHORT}, headers={"Idempotency-Key": "1"})
    assert (again.status_code, again.json()["id"]) == (200, waiting)  # accepted once, accepted for good
    refused = api.post("experiments", json={"spec": SHORT})
    assert (refused.status_code, refused.json()["type"]) == (507, "/api/v1/problems#no-room")
    assert refused.json()["detail"] == "1 MB are free for traces, 20 MB stay free"
    uploaded = api.post("traces", content="time\n0\n", headers={"Content-Type": "text/csv"})
    assert (uploaded.status_code, uploaded.json()["type"]) == (507, "/api/v1/problems#no-room")
    ready = api.get(api.base_url.join("/readyz"))
    assert (ready.status_code, ready.json()["checks"]["traces"]) == (503, "1 MB are free, 20 MB stay free")
    assert [one["id"] for one in api.get("queue/experiments").json()] == [waiting]


def test_what_was_carried_out_is_told_though_no_event_of_it_can_be_written(
    api: httpx.Client, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuses(*_args: object) -> NoReturn:
        raise OperationalError("INSERT", {}, Exception("database or disk is full"))

    with monkeypatch.context() as meanwhile:
        meanwhile.setattr(EventStore, "add", refuses)
        answer = api.post("control", json={})
        assert answer.status_code == 201, answer.text
        assert api.delete("control", headers={"Control-Lease": answer.json()["lease"]}).status_code == 204
        made = _submit(api)
        assert [one["id"] for one in api.get("queue/experiments").json()] == [made]
        assert api.post("queue/pause").json()["paused"]
        assert _listed(api, "events") == []
    found = until(api, "events", lambda page: len(page["items"]) == 4)["items"]
    assert [event["kind"] for event in found] == ["queue", "experiment", "control", "control"]


def test_a_stop_while_another_program_holds_the_database_is_told_later_with_its_time(
    tmp_path: Path, clock: WrongClock, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("server.store.engine.BUSY_TIMEOUT_MS", 50)
    with service_inside(tmp_path, clock, monkeypatch) as api:
        ready = str(api.base_url.join("/readyz"))
        with closing(sqlite3.connect(tmp_path / "service" / "service.sqlite")) as other:
            other.execute("BEGIN EXCLUSIVE")
            begun = datetime.now(UTC)
            assert api.post("stop").status_code == 200
            told = api.get(ready)
            assert (told.status_code, told.json()["checks"]["database"]) == (503, "locked by another program")
            ended = datetime.now(UTC)
        found = until(api, "events", lambda page: any(event["kind"] == "stop" for event in page["items"]))["items"]
        assert all(begun <= datetime.fromisoformat(event["at"]) <= ended for event in found if event["kind"] == "stop")


def test_a_file_that_cannot_be_written_is_refused_and_leaves_nothing(
    api: httpx.Client, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    number = 0

    def refuses(_descriptor: int) -> NoReturn:
        raise OSError(number, os.strerror(number))

    monkeypatch.setattr(os, "fsync", refuses)
    for number, status, kind in (  # noqa: B007  # `refuses` reads the number
        (errno.ENOSPC, 507, "no-room"),
        (errno.EROFS, 503, "disk"),
        (errno.EIO, 503, "disk"),
    ):
        answer = api.post("traces", content=TABLE, headers={"Content-Type": "text/csv"})
        assert (answer.status_code, answer.json()["type"]) == (status, f"/api/v1/problems#{kind}"), answer.text
        assert _listed(api, "traces") == []
        assert list((tmp_path / "traces").glob("*.mcap")) == []


def test_a_look_into_the_folder_while_a_trace_is_uploaded_takes_nothing_away(
    api: httpx.Client, monkeypatch: pytest.MonkeyPatch
) -> None:
    catalogues: list[Catalogue] = []
    path_of, read = Catalogue.path_of, upload._read

    def known(self: Catalogue, identity: str) -> Path:
        catalogues.append(self)
        return path_of(self, identity)

    def then_looked(order: Order, uploads: Uploads, kind: str) -> dict[str, Any]:
        made = read(order, uploads, kind)
        catalogues[0].bring_up_to_date()
        return made

    monkeypatch.setattr(Catalogue, "path_of", known)
    api.get("traces/none/data.mcap")
    monkeypatch.setattr("server.api.upload._read", then_looked)
    answer = api.post("traces", content=TABLE, headers={"Content-Type": "text/csv"})
    assert answer.status_code == 201, answer.text
    assert api.get(f"traces/{answer.json()['id']}/data.mcap").status_code == 200


# ---- what the service says about itself then, and to whom


STRANGER = {"X-Forwarded-For": "10.0.0.9"}


def _read_only(**_: object) -> NoReturn:
    raise OSError(errno.EROFS, os.strerror(errno.EROFS), "/the/folder")


def test_a_disk_that_cannot_be_written_is_not_ready_and_only_who_may_see_the_robot_is_told_why(
    api: httpx.Client, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("server.services.KEPT_FOR", 0.0)
    address = api.base_url.join("/readyz")
    healthy = {"database": "", "traces": "", "disk space": "", "robot ma2000": ""}
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


def test_the_size_of_the_database_counts_what_was_written_last(api: httpx.Client, tmp_path: Path) -> None:
    for _ in range(20):
        api.post("/experiments", json={}).raise_for_status()  # SQLite writes them to its log first
    log = tmp_path / "service" / "service.sqlite-wal"
    assert log.stat().st_size > 0
    told = api.get(api.base_url.join("/api/v1/system")).json()["storage"]["database_size"]
    assert told >= log.stat().st_size
