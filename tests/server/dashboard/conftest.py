"""One service, one mock and one Chromium for all tests of the dashboard; a new tab for each."""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pytest
from playwright.sync_api import Browser, Playwright

from daq.transport.mock_process import start_mock
from daq.transport.url import MockPort, parse_port_url
from tests.server.dashboard.browser import (
    WIDE,
    WITHOUT_3D,
    Dashboard,
    MockControl,
    chromium,
    find_chromium,
    playwright,
    watched,
)
from tests.server.dashboard.studied import Studied, studied_arm
from tests.server.polling import reset
from tests.server.service import Service, running_service

LONGEST_TEST_S = 300
"""A browser, a service and a mock share two cores: what takes two seconds alone may take a minute beside others."""


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Tests of this folder may wait longer than others; those that say how long keep that."""
    for item in items:
        if item.path.parent == Path(__file__).parent and item.get_closest_marker("timeout") is None:
            item.add_marker(pytest.mark.timeout(LONGEST_TEST_S))


@pytest.fixture(scope="package")
def driver() -> Iterator[Playwright]:
    """What drives browsers. It has an event loop of its own in this thread, and ends before other tests want one."""
    with playwright() as found:
        yield found


@pytest.fixture(scope="package")
def browser(driver: Playwright) -> Iterator[Browser]:
    """The system's Chromium, without 3-D; a test that asks for it is skipped where there is none."""
    with chromium(driver, *WITHOUT_3D) as found:
        yield found


@pytest.fixture(scope="package")
def served(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[Service, MockControl]]:
    """A service, connected to a mock in real time, and the mock's own control port.

    The mock's line has a name that stays when it is pulled and plugged in again, as that of a real cable does.
    """
    find_chromium()
    folder = tmp_path_factory.mktemp("dashboard")
    port = parse_port_url("mock://?pty=1&seed=3")
    assert isinstance(port, MockPort)
    mock = start_mock(replace(port, arguments=(*port.arguments, "--link", str(folder / "cable"))))
    control = MockControl(mock)
    try:
        (folder / "daq.toml").write_text("[server]\nconnect_at_start = false\n")  # the tests connect it
        with running_service(folder, mock.url) as service:
            service.until_connected()
            yield service, control
    finally:
        control.close()
        mock.close()


@pytest.fixture
def dashboard(browser: Browser, served: tuple[Service, MockControl]) -> Iterator[Dashboard]:
    """A tab on a service as every test wants to find it: not stopped, nobody in control, the queue open and empty, no
    program kept. No layout is left behind."""
    service, mock = served
    service.until_connected()
    for one in service.robot.get("/queue/experiments").json():
        service.robot.post(f"/experiments/{one['id']}/cancel")
    for one in service.robot.get("/programs").json():
        service.robot.delete(f"/programs/{one['name']}")
    reset(service.robot)
    service.robot.post("/queue/resume", json={})
    context = browser.new_context(viewport=WIDE, color_scheme="light")
    tab = watched(context, service, mock)
    yield tab
    context.close()
    service.client.put("/me/layouts", json={"text": ""})
    assert tab.complaints == []


@pytest.fixture(scope="package")
def studied(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Studied]:
    """A service that has studied its arm: traces, a fit, a validation, a diagnosis."""
    find_chromium()
    with studied_arm(tmp_path_factory.mktemp("studied")) as found:
        yield found


@pytest.fixture
def studied_dashboard(browser: Browser, studied: Studied) -> Iterator[Dashboard]:
    """A tab on that service, its queue paused: what is queued stays there."""
    studied.service.robot.post("/queue/pause", json={})
    context = browser.new_context(viewport=WIDE, color_scheme="light")
    tab = watched(context, studied.service)
    yield tab
    complaints = list(tab.complaints)  # not of what a tab says while it is closed, a socket that was just being opened
    context.close()
    assert complaints == []
