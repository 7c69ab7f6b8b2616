"""Databases of both kinds, new for each test."""

from collections.abc import Iterator
from contextlib import closing
from pathlib import Path

import pytest

from server.store.engine import Store
from tests.extras.lab.postgresql.server import PostgresServer, programs, running_postgresql
from tests.server.conftest import sqlite_store


@pytest.fixture(scope="package")
def postgresql() -> Iterator[PostgresServer]:
    """A PostgreSQL server with a migrated database `template`."""
    found = programs()
    if found is None:
        pytest.skip("PostgreSQL is not installed")
    with running_postgresql(found) as server:
        with closing(Store(server.database())) as made:
            made.migrate()
        yield server


@pytest.fixture(params=["sqlite", "postgresql"])
def store(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[Store]:
    """A new database of each kind."""
    if request.param == "sqlite":
        yield request.getfixturevalue("sqlite_store")
        return
    server: PostgresServer = request.getfixturevalue("postgresql")
    made = Store(server.database(template="made1"))
    yield made
    made.close()


__all__ = ["postgresql", "sqlite_store", "store"]
