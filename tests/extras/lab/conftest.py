"""The service of the tests of what a laboratory adds, one of their own; databases of both kinds."""

from tests.extras.lab.postgresql.databases import postgresql, sqlite_store, store
from tests.server.conftest import service, shared_service

__all__ = ["postgresql", "service", "shared_service", "sqlite_store", "store"]
