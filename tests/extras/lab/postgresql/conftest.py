"""A database of PostgreSQL, new for each test."""

from collections.abc import Iterator

import pytest

from server.store.engine import Store
from tests.extras.lab.postgresql.server import PostgresServer


@pytest.fixture
def store(postgresql: PostgresServer) -> Iterator[Store]:
    """With the tables of the service."""
    made = Store(postgresql.database(template="made1"))
    yield made
    made.close()
