"""The service and the database of the tests of what a laboratory adds."""

from tests.server.conftest import service, shared_service, store

__all__ = ["service", "shared_service", "store"]
