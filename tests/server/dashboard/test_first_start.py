"""The tour of the first start, and the shell that opens without the service."""

from pathlib import Path

import pytest
from playwright.sync_api import Browser, Page, expect

from tests.server.dashboard.browser import PATIENCE_MS, Dashboard, MockControl
from tests.server.dashboard.faults import faults_of
from tests.server.service import Service, running_service

pytestmark = [pytest.mark.browser, pytest.mark.slow]
PHONE = {"width": 360, "height": 740}


def _first(browser: Browser, address: str) -> Page:
    page = browser.new_context(viewport=PHONE, reduced_motion="reduce").new_page()  # type: ignore[arg-type]
    page.set_default_timeout(PATIENCE_MS)
    page.goto(address)
    return page


def test_the_tour_comes_once_blocks_nothing_and_leads_to_the_demonstration(
    browser: Browser, served: tuple[Service, MockControl], dashboard: Dashboard
) -> None:
    service, _ = served
    late = _first(browser, f"{service.url}/#/traces")
    late.get_by_role("link", name="Live").click()
    expect(late.get_by_role("region", name="The arm now")).to_be_visible()
    expect(late.get_by_role("dialog")).to_have_count(0)
    late.context.close()
    page = _first(browser, service.url)
    tour = page.get_by_role("dialog")
    expect(tour).to_have_accessible_name("This arm is a mock")
    expect(page.get_by_role("heading", name="This arm is a mock")).to_be_focused()
    assert faults_of(page) == []
    page.get_by_role("button", name="STOP").click(trial=True)
    for _step in range(4):
        page.get_by_role("button", name="Next").focus()
        page.keyboard.press("Enter")
    page.get_by_role("button", name="Open it").click()
    expect(page.get_by_role("heading", level=1, name="Hide something from me")).to_be_visible()
    expect(tour).to_have_count(0)
    page.goto(service.url)
    page.reload()
    expect(page.get_by_role("region", name="The arm now")).to_be_visible()
    expect(tour).to_have_count(0)
    page.goto(f"{service.url}/#/system")
    page.get_by_role("button", name="Keys and words").click()
    page.get_by_role("link", name="Show the tour").click()
    expect(tour).to_be_visible()
    page.goto(f"{service.url}/#/system")
    page.get_by_role("link", name="Go on with the tour").click()
    expect(tour).to_have_accessible_name("This arm is a mock")
    page.keyboard.press("Escape")
    expect(tour).to_have_count(0)
    expect(page.locator("#content")).to_be_focused()
    page.context.close()


def test_without_the_service_the_shell_opens_and_shows_nothing_as_live(browser: Browser, tmp_path: Path) -> None:
    with running_service(tmp_path, "mock://?pty=1&lock_step=1") as service:
        service.until_connected()
        page = _first(browser, service.url)
        page.evaluate("navigator.serviceWorker.ready")
        page.reload()
        expect(page.get_by_role("region", name="The arm now")).to_be_visible()
        sources = page.evaluate(
            """() => performance.getEntriesByType('resource').filter((one) => one.name.includes('/api/'))
                .map((one) => one.workerFinalSourceType)"""
        )
        assert set(sources) == {"network"}  # no request of the API, a stop least of all, waits for the worker
    page.reload()
    expect(page.get_by_text("The service cannot be reached")).to_be_visible()
    expect(page.locator("table, canvas, [data-kind]")).to_have_count(0)
    assert faults_of(page) == []
    page.keyboard.press("F8")
    expect(page.locator("[role=alert] [data-stop]")).to_contain_text("NOT DELIVERED")
    page.context.close()
