"""A browser for one file of tests. It ends with the file: while it is there, no other test can start one."""

from collections.abc import Iterator

import pytest
from playwright.sync_api import Browser

from tests.server.dashboard.browser import WITHOUT_3D, chromium, playwright


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    """The system's Chromium, without 3-D."""
    with playwright() as driver, chromium(driver, *WITHOUT_3D) as found:
        yield found
