"""A database, new for each test."""

from collections.abc import Iterator
from pathlib import Path

import pytest

from server.store.engine import Store
from tests.server.migrated import migrated_store


@pytest.fixture
def sqlite_store(tmp_path: Path) -> Iterator[Store]:
    """A new SQLite database."""
    made = migrated_store(tmp_path / "service.sqlite")
    yield made
    made.close()


@pytest.fixture
def store(sqlite_store: Store) -> Store:
    """The same; plug-ins have other kinds (tests/extras/lab/postgresql)."""
    return sqlite_store
