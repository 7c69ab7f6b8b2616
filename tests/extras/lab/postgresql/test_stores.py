"""The tests of the stores, on PostgreSQL."""

from tests.server.store.test_store import *  # noqa: F403
