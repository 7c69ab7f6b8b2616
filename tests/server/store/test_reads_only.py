"""A service that only reads beside the one that owns the arms: two processes on one database of PostgreSQL."""

from __future__ import annotations

import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from sqlalchemy.exc import DatabaseError

from server.store.engine import Store, StoreError
from server.store.lock import InUseError, owner_of, sole_use
from server.store.traces import TraceSearch, TraceStore
from tests.server.postgresql import PostgresServer
from tests.server.service import DAQ, MOCK, Service, running_service
from tests.server.store.rows import new_trace

RAMP = {
    "spec": {
        "name": "first",
        "trajectory": {"kind": "ramp", "amplitude": 0.05, "duration": 0.2},
        "settle": 0.1,
        "hold": 0.1,
    }
}


def _daq(url: str, *words: str) -> subprocess.CompletedProcess[str]:
    """What a command says at a service."""
    return subprocess.run([*DAQ, "--server", url, *words], capture_output=True, text=True, check=False)


@contextmanager
def _beside(folder: Path, database: str) -> Iterator[tuple[Service, Service]]:
    """The service that owns the arm, and one that only reads, with the same folders."""
    for name in ("owner", "reader"):
        (folder / name).mkdir()
        shared = f'folder = "{folder / "owner" / "service"}"\ndatabase = "{database}"\n'
        lines = f'[traces]\nfolder = "{folder / "owner" / "traces"}"\n[server]\n{shared}'
        (folder / name / "daq.toml").write_text(lines, "utf-8")
    with running_service(folder / "owner") as owner, running_service(folder / "reader", MOCK, "--reads-only") as reader:
        yield owner, reader


def test_one_service_owns_the_arm_and_the_other_reads(postgresql: PostgresServer, tmp_path: Path) -> None:
    database = postgresql.database(template="made1")
    with _beside(tmp_path, database) as (owner, reader):
        owner.until_connected()
        owner.robot.post("/queue/resume", json={}).raise_for_status()
        assert reader.robot.get("/experiments").json()["items"] == []
        made = owner.robot.post("/experiments", json=RAMP).json()["id"]
        trace = owner.end_of(made)["trace"]

        # What the owner has written is read at once, each time anew.
        assert reader.robot.get(f"/experiments/{made}").json()["state"] == "done"
        assert [one["id"] for one in reader.robot.get("/experiments").json()["items"]] == [made]
        assert [one["id"] for one in reader.robot.get("/traces", params={"q": "ramp"}).json()["items"]] == [trace]
        owner.robot.patch(f"/traces/{trace}", json={"tags": ["good"]}).raise_for_status()
        assert [one["id"] for one in reader.robot.get("/traces", params={"tag": "good"}).json()["items"]] == [trace]
        assert reader.robot.get(f"/traces/{trace}/data.mcap").content == (
            owner.robot.get(f"/traces/{trace}/data.mcap").content
        )
        assert "first" in reader.robot.get(f"/traces/{trace}").text
        assert reader.client.get("/audit").json() == owner.client.get("/audit").json()

        (robot,) = reader.client.get("/robots").json()  # by which clients learn its name
        assert (robot["robot"], robot["connection"], robot["arm"]) == ("ma2000", "elsewhere", None)
        by_command = _daq(reader.url, "traces", "ls")
        assert by_command.returncode == 0, by_command.stderr
        assert trace[:6] in by_command.stdout

        # It changes nothing, shows nothing of the arm, and says who does.
        for answer in (
            reader.robot.post("/experiments", json=RAMP),
            reader.robot.patch(f"/traces/{trace}", json={"tags": []}),
            reader.robot.post("/connect"),
            reader.robot.post("/stop"),
            reader.client.post("/fleet/stop"),
            reader.client.get("/robots/ma2000"),
            reader.robot.get("/queue"),
            reader.robot.get("/live/frame"),
        ):
            assert answer.status_code == 409, answer.request.url
            assert answer.json()["type"] == "docs/service.md#reads-only"
            assert owner.url in answer.json()["advice"]
        stop = _daq(reader.url, "stop")
        assert (stop.returncode, "NOT DELIVERED" in stop.stderr + stop.stdout) == (3, True)
        assert owner.url in stop.stderr + stop.stdout
        assert owner.url in reader.client.get("/system").json()["warnings"][0]
        assert reader.client.get(f"{reader.url}/readyz").json()["status"] == "ok"
        assert owner.status()["arm"] == "idle"  # the stop that was refused has stopped nothing

        owner.process.kill()
        owner.process.wait()
        assert reader.robot.get(f"/experiments/{made}").json()["state"] == "done"
        assert "none runs now" in reader.robot.post("/stop").json()["advice"]
        with running_service(tmp_path / "owner") as again:
            assert again.url in reader.robot.post("/stop").json()["advice"]
            assert reader.end() == 0


def test_postgresql_itself_refuses_what_a_reading_service_would_write(postgresql: PostgresServer) -> None:
    address = postgresql.database(template="made1")
    writing, reading = Store(address), Store(address, reads_only=True)
    reading.migrate()
    found = TraceStore(reading)
    assert found.page("ma2000", TraceSearch(), None, 10).items == ()
    TraceStore(writing).insert(new_trace(1))
    assert [one.id for one in found.page("ma2000", TraceSearch(), None, 10).items] == [f"{1:012x}"]
    with pytest.raises(DatabaseError, match="read-only transaction"):
        found.insert(new_trace(2))
    for store in (writing, reading):
        store.close()


def test_only_tables_of_its_own_version_are_read(postgresql: PostgresServer) -> None:
    address = postgresql.database()
    reading = Store(address, reads_only=True)
    with pytest.raises(StoreError, match=r"its tables are of version none, and this program's of \d+"):
        reading.migrate()
    reading.close()


def test_the_lock_tells_who_holds_it_also_after_it_was_taken_again(postgresql: PostgresServer) -> None:
    address = postgresql.database(template="made1")
    reading = Store(address, reads_only=True)
    assert owner_of(reading) == "none runs now"
    with sole_use(address) as tell:
        tell("http://127.0.0.1:8300 at bench")
        assert owner_of(reading) == "http://127.0.0.1:8300 at bench"
        with pytest.raises(InUseError, match="a service uses it"), sole_use(address):
            pass
        other = Store(postgresql.database(template="made1"), reads_only=True)
        assert owner_of(other) == "none runs now"
        other.close()
    assert owner_of(reading) == "none runs now"
    reading.close()


def test_on_sqlite_one_line_says_what_is_needed(tmp_path: Path) -> None:
    told = subprocess.run(
        [*DAQ, "--port", "mock://", "serve", "--port", "0", "--reads-only"],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        check=False,
    )
    assert told.returncode == 2
    assert "a service that only reads needs one of PostgreSQL: name it in server.database" in told.stderr
    assert not list(tmp_path.rglob("*.sqlite"))
