"""The tests of the stores, on PostgreSQL."""

from tests.server.store.test_several_robots import *  # noqa: F403
from tests.server.store.test_store import *  # noqa: F403
