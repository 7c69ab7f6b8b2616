"""Databases of both kinds, new for each test."""

from tests.extras.lab.postgresql.databases import postgresql, sqlite_store, store

__all__ = ["postgresql", "sqlite_store", "store"]
