"""A service that only reads beside the one that owns the arms: two processes on one database of PostgreSQL."""

from __future__ import annotations

import asyncio
import json
import socket
import subprocess
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import httpx
import pytest
from sqlalchemy import text
from sqlalchemy.exc import DatabaseError
from starlette.types import Message, Receive, Scope, Send

from daq.client.stopping import stop_addresses
from server.access.caller import LOCAL, Caller
from server.reading import reads_only
from server.store.address import open_engine
from server.store.engine import Store, StoreError
from server.store.lock import InUseError, ServerLock, owner_of, sole_use
from server.store.owner_name import owner_name
from server.store.traces import TraceSearch, TraceStore
from tests.server.postgresql import PostgresServer
from tests.server.service import DAQ, MOCK, START_WITHIN, Service, running_service
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
    """The service that owns the arm, and one that only reads, with the same folders, and with the stop port of the
    first, as where both have one configuration."""
    shared = f'folder = "{folder / "owner" / "service"}"\ndatabase = "{database}"\n'
    lines = f'[traces]\nfolder = "{folder / "owner" / "traces"}"\n[server]\n{shared}'
    for name in ("owner", "reader"):
        (folder / name).mkdir()
    (folder / "owner" / "daq.toml").write_text(lines, "utf-8")
    with running_service(folder / "owner") as owner:
        stop_port = owner.client.get("/system").json()["stop_port"]
        (folder / "reader" / "daq.toml").write_text(f"{lines}stop_port = {stop_port}\n", "utf-8")
        with running_service(folder / "reader", MOCK, "--reads-only") as reader:
            yield owner, reader


def _place(service: Service) -> str:
    """What others are told of a service that listens at loopback."""
    return f"port {service.client.base_url.port} of {socket.gethostname()}"[:60]


@pytest.mark.slow
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
            assert answer.json()["type"] == "/api/v1/problems#reads-only"
            assert _place(owner) in answer.json()["advice"]
        # Where clients ask for a stop as well, it is this service that refuses it, and no other one can listen.
        first, second = stop_addresses(reader.url)
        for address in (first, second):
            refused = httpx.post(f"{address}/api/v1/robots/ma2000/stop", timeout=START_WITHIN)
            assert (refused.status_code, refused.headers["X-Content-Type-Options"]) == (409, "nosniff")
            assert _place(owner) in refused.json()["advice"]
        stop = _daq(reader.url, "stop")
        assert (stop.returncode, "NOT DELIVERED" in stop.stderr + stop.stdout) == (3, True)
        assert _place(owner) in stop.stderr + stop.stdout
        assert _place(owner) in reader.client.get("/system").json()["warnings"][0]
        assert reader.client.get(f"{reader.url}/readyz").json()["status"] == "ok"
        assert owner.status()["arm"] == "idle"  # the stop that was refused has stopped nothing

        owner.process.kill()
        owner.process.wait()
        assert reader.robot.get(f"/experiments/{made}").json()["state"] == "done"
        assert "none runs now" in reader.robot.post("/stop").json()["advice"]
        with running_service(tmp_path / "owner") as again:
            assert _place(again) in reader.robot.post("/stop").json()["advice"]
        postgresql.stop()
        try:
            away = reader.robot.post("/stop")
        finally:
            postgresql.start()
        assert (away.status_code, away.headers["X-Content-Type-Options"]) == (409, "nosniff")
        assert "its address cannot be read now" in away.json()["advice"]
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


def test_the_lock_tells_who_holds_it(postgresql: PostgresServer) -> None:
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


def test_the_lock_tells_who_holds_it_also_after_it_was_taken_again(postgresql: PostgresServer) -> None:
    address = postgresql.database(template="made1")
    reading, engine = Store(address, reads_only=True), open_engine(address)
    lock = ServerLock(engine, "database", lambda: None)
    lock.tell("port 8300 of bench")
    postgresql.stop()
    postgresql.start()
    assert owner_of(reading) == "none runs now"
    assert lock.look()
    assert owner_of(reading) == "port 8300 of bench"
    lock.close()
    engine.dispose()
    reading.close()


def test_a_lock_of_two_numbers_is_none_of_a_service(postgresql: PostgresServer) -> None:
    reading = Store(postgresql.database(template="made1"), reads_only=True)
    number = int.from_bytes(b"ma2000dq")
    with reading.engine.connect() as connection:
        two = {"high": number >> 32, "low": number & 0xFFFFFFFF}
        connection.execute(text("SELECT pg_advisory_lock_shared(:high, :low)"), two)
        assert owner_of(reading) == "none runs now"
    reading.close()


@pytest.fixture
def silent(monkeypatch: pytest.MonkeyPatch) -> Iterator[threading.Event]:
    """A database that does not answer who the owner is until the test has ended. The event says that it was asked."""
    asked, ended = threading.Event(), threading.Event()

    def ask(_store: Store) -> str:
        asked.set()
        ended.wait()
        return "port 8300 of bench"

    monkeypatch.setattr("server.reading.owner_of", ask)
    yield asked
    ended.set()


def _advice(postgresql: PostgresServer, caller: Caller | None) -> str:
    """What a service that only reads advises to do in place of a stop."""
    store = Store(postgresql.address("made1"), reads_only=True)
    sent: list[Message] = []

    async def nothing() -> Message:
        return {"type": "http.request", "body": b"", "more_body": False}

    async def keep(message: Message) -> None:
        sent.append(message)

    async def never(_scope: Scope, _receive: Receive, _send: Send) -> None:
        raise AssertionError("it answers what it must refuse")

    scope = {"type": "http", "method": "POST", "path": "/api/v1/fleet/stop", "headers": [], "state": {"caller": caller}}
    asyncio.run(reads_only(never, store)(scope, nothing, keep))  # type: ignore[arg-type]
    store.close()
    assert sent[0]["status"] == 409
    advice: str = json.loads(sent[1]["body"])["advice"]
    return advice


def test_a_stop_is_refused_in_time_while_the_database_does_not_answer(
    postgresql: PostgresServer, silent: threading.Event
) -> None:
    assert "its address cannot be read now" in _advice(postgresql, LOCAL)
    assert silent.is_set()


def test_who_is_not_known_is_not_told_where_the_owner_is(postgresql: PostgresServer, silent: threading.Event) -> None:
    assert "callers with a token are told where it is" in _advice(postgresql, None)
    assert not silent.is_set()


@pytest.mark.parametrize(
    ("names", "bound", "computer", "told"),
    [
        ([], "127.0.0.1", "bench", "port 8300 of bench"),
        ([], "0.0.0.0", "bench", "port 8300 of bench"),
        ([], "::", "bench", "port 8300 of bench"),
        ([], "192.0.2.7", "bench", "http://192.0.2.7:8300 (port 8300 of bench)"),
        ([], "2001:db8::7", "bench", "http://[2001:db8::7]:8300 (port 8300 of bench)"),
        (["arm.lab", "arm"], "127.0.0.1", "bench", "arm.lab (port 8300 of bench)"),
        (["roboter-für-alle.lab"], "127.0.0.1", "bench", "port 8300 of bench"),
        (["a" * 63], "127.0.0.1", "bench", "a" * 63),
        (["a" * 64], "127.0.0.1", "bench", "port 8300 of bench"),
        (["a" * 64], "127.0.0.1", "b" * 64, f"port 8300 of {'b' * 47}..."),
        ([], "127.0.0.1", "b" * 64, f"port 8300 of {'b' * 47}..."),
    ],
)
def test_the_owner_is_told_so_that_others_find_it(names: list[str], bound: str, computer: str, told: str) -> None:
    assert owner_name(names, bound, 8300, computer) == told
    assert len(told.encode()) <= 63


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
