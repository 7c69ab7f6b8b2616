"""PostgreSQL below the service: one service at a time, nothing lost when its server ends, wrong values refused."""

from __future__ import annotations

from datetime import UTC, datetime
from pathlib import Path

import pytest
from alembic import command
from sqlalchemy import insert, text

from server.clock import SystemClock
from server.stopping.tokens import reader_of
from server.store.address import open_engine
from server.store.engine import Store, StoreError, migrations
from server.store.lock import InUseError, ServerLock, sole_use
from server.store.tables import TraceRow
from server.store.traces import TraceSearch, TraceStore
from tests.server.inside import service_inside
from tests.server.postgresql import PostgresServer
from tests.server.store.rows import new_trace

NOW = datetime(2026, 1, 1, tzinfo=UTC)


def _must_not_be_called() -> None:
    raise AssertionError


def test_one_service_at_a_time_uses_a_database(postgresql: PostgresServer) -> None:
    first, other = postgresql.database(), postgresql.database()
    with sole_use(first):
        with pytest.raises(InUseError, match="a service uses it; end that one first"), sole_use(first):
            pass
        with sole_use(other):
            pass
    with sole_use(first):
        pass


def test_a_server_that_cannot_be_reached_is_told_in_one_line() -> None:
    address = "postgresql+psycopg://anna:secret@/daq?host=/nowhere"
    expected = pytest.raises(StoreError, match=r"database postgresql\+psycopg://anna:\*\*\*@/daq.*cannot be opened")
    with expected as told, sole_use(address):
        pass
    assert "\n" not in str(told.value)


def test_the_lock_is_taken_again_after_the_server_was_away_unless_another_service_has_it(
    postgresql: PostgresServer,
) -> None:
    address = postgresql.database()
    engine = open_engine(address)
    lock = ServerLock(engine, "database", _must_not_be_called)
    postgresql.stop()
    assert lock.look()  # nobody else can have it
    postgresql.start()
    assert lock.look()
    with pytest.raises(InUseError), sole_use(address):
        pass
    postgresql.stop()
    postgresql.start()
    with sole_use(address):
        assert not lock.look()
    lock.close()
    engine.dispose()


def test_an_older_database_is_brought_up_to_date_and_searched(postgresql: PostgresServer) -> None:
    store = Store(postgresql.database(template="made1"))
    config = migrations()
    with store.engine.connect() as connection:
        config.attributes["connection"] = connection
        command.downgrade(config, "0005")
        connection.commit()
    _insert_as_older_versions_did(store, "brass bush")
    store.migrate()
    store.require_sound()
    traces = TraceStore(store)
    for text_ in ("ass bu", "ss", "h"):
        assert [one.id for one in traces.found("ma2000", TraceSearch(text=text_), None, 10).items] == [f"{1:012x}"]
    store.close()


def _insert_as_older_versions_did(store: Store, notes: str) -> None:
    row = {
        **new_trace(1, notes=notes).__dict__,
        "joints": [1, 2, 3],
        "missing": False,
        "searched": f"{1:012x}\n{notes}",
    }
    with store.writing() as session:
        session.execute(insert(TraceRow), [row])


def test_a_lost_extension_costs_speed_and_finds_the_same(postgresql: PostgresServer) -> None:
    store = Store(postgresql.database(template="made1"))
    with store.writing() as session:
        session.execute(text("DROP EXTENSION pg_trgm CASCADE"))
    store.migrate()
    traces = TraceStore(store)
    traces.insert(new_trace(1, notes="brass bush"))
    assert [one.id for one in traces.page("ma2000", TraceSearch(text="ass bu"), None, 10).items] == [f"{1:012x}"]
    store.close()


def test_the_stop_listener_reads_its_tokens_there(postgresql: PostgresServer) -> None:
    address = postgresql.database(template="made1")
    store = Store(address)
    with store.writing() as session:
        row = {"id": "1", "name": "anna", "role": "operator", "digest": "d", "created": NOW.replace(tzinfo=None)}
        session.execute(text("INSERT INTO tokens VALUES (:id, :name, :role, :digest, :created, NULL)"), row)
    store.close()
    callers = reader_of(address, None)()
    assert {digest: (caller.name, caller.role) for digest, caller in callers.items()} == {"d": ("anna", "operator")}


def test_the_service_keeps_everything_in_it_and_refuses_what_it_cannot_hold(
    postgresql: PostgresServer, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    address = postgresql.database(template="made1")
    store = Store(address)
    TraceStore(store).insert(new_trace(1))
    store.close()
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
