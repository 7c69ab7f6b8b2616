"""The service of the tests of what a laboratory adds: one of their own, as tests/server has."""

from tests.server.conftest import service, shared_service

__all__ = ["service", "shared_service"]
