"""Databases of both kinds, new for each test."""

from tests.server.store.conftest import postgresql, sqlite_store, store

__all__ = ["postgresql", "sqlite_store", "store"]
