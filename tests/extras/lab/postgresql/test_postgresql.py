"""PostgreSQL below the service: one service at a time, nothing lost when its server ends, wrong values refused."""

from contextlib import closing
from datetime import UTC, datetime
from pathlib import Path

import pytest
from sqlalchemy import text

from daq.contracts.errors import ReachError, SpecError
from extras.lab.postgresql.lock import ServerLock
from server.clock import SystemClock
from server.stopping.tokens import reader_of
from server.store.address import open_engine
from server.store.engine import Store
from server.store.lock import sole_use
from server.store.traces import TraceStore
from tests.extras.lab.postgresql.server import PostgresServer
from tests.server.inside import service_inside
from tests.server.store.rows import new_trace

NOW = datetime(2026, 1, 1, tzinfo=UTC)


def _must_not_be_called() -> None:
    raise AssertionError


def test_one_service_at_a_time_uses_a_database(postgresql: PostgresServer) -> None:
    first, other = postgresql.database(), postgresql.database()
    with sole_use(first):
        with pytest.raises(ReachError, match="a service uses it; end that one first"), sole_use(first):
            pass
        with sole_use(other):
            pass
    with sole_use(first):
        pass


def test_a_server_that_cannot_be_reached_is_told_in_one_line() -> None:
    address = "postgresql+psycopg://anna:secret@/daq?host=/nowhere"
    expected = pytest.raises(SpecError, match=r"database postgresql\+psycopg://anna:\*\*\*@/daq.*cannot be opened")
    with expected as told, sole_use(address):
        pass
    assert "\n" not in str(told.value)


def test_the_lock_is_taken_again_after_the_server_was_away_unless_another_service_has_it(
    postgresql: PostgresServer,
) -> None:
    address = postgresql.database()
    engine = open_engine(address)
    with closing(ServerLock(engine, "database", _must_not_be_called)) as lock:
        postgresql.stop()
        assert lock.look()  # nobody else can have it
        postgresql.start()
        assert lock.look()
        with pytest.raises(ReachError), sole_use(address):
            pass
        postgresql.stop()
        postgresql.start()
        with sole_use(address):
            assert not lock.look()
    engine.dispose()


def test_the_stop_listener_reads_its_tokens_there(postgresql: PostgresServer) -> None:
    address = postgresql.database(template="made1")
    with closing(Store(address)) as store, store.writing() as session:
        row = {"id": "1", "name": "anna", "role": "operator", "digest": "d", "created": NOW.replace(tzinfo=None)}
        session.execute(text("INSERT INTO tokens VALUES (:id, :name, :role, :digest, :created, NULL)"), row)
    callers = reader_of(address, None)()
    assert {digest: (caller.name, caller.role) for digest, caller in callers.items()} == {"d": ("anna", "operator")}


def test_the_service_keeps_everything_in_it_and_refuses_what_it_cannot_hold(
    postgresql: PostgresServer, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    address = postgresql.database(template="made1")
    with closing(Store(address)) as store:
        TraceStore(store).insert("ma2000", new_trace(1))
    with service_inside(tmp_path, SystemClock(), monkeypatch, address) as api:
        assert api.post("/queue/pause", json={}).status_code == 200
        made = api.post("/experiments", json={}).json()
        refused = api.patch(f"/traces/{1:012x}", json={"notes": "nul \0 here"})
        assert (refused.status_code, refused.json()["type"]) == (422, "/api/v1/problems#not-valid"), refused.text
        assert api.get(f"/experiments/{made['id']}").json()["state"] == "queued"
        assert [one["id"] for one in api.get("/queue/experiments").json()] == [made["id"]]
    assert not list(tmp_path.rglob("*.sqlite"))
    with service_inside(tmp_path, SystemClock(), monkeypatch, address) as api:
        assert [one["id"] for one in api.get("/queue/experiments").json()] == [made["id"]]
        assert api.get("/queue").json()["paused"]
        postgresql.stop()
        assert api.get("/experiments", params={"limit": 7}).status_code == 503
        assert api.post("/stop").status_code == 200
        postgresql.start()
        assert api.get("/experiments", params={"limit": 7}).status_code == 200


@pytest.mark.parametrize(
    ("address", "said"),
    [
        ("postgresql+psycopg2://anna:secret@db/arm", r"anna:\*\*\*@db/arm: its driver psycopg2 is not installed"),
        ("postgresql+pg8000://db/arm", "driver pg8000 is not installed: `pip install 'pg8000'`"),
    ],
)
def test_a_driver_that_is_missing_is_named(address: str, said: str) -> None:
    with pytest.raises(SpecError, match=said):
        open_engine(address)
