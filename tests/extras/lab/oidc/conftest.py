"""A browser, as the tests of the page have it."""

from tests.server.dashboard.conftest import browser, driver

__all__ = ["browser", "driver"]
