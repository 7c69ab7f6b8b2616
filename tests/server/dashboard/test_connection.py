"""A lost connection cannot be overlooked, and heals by itself."""

import pytest
from playwright.sync_api import expect

from tests.server.dashboard.browser import LIVE, Dashboard
from tests.server.dashboard.test_stop import hanging

pytestmark = pytest.mark.browser


def test_a_service_that_cannot_tell_about_itself_is_shown_all_the_same(dashboard: Dashboard) -> None:
    dashboard.page.route("**/api/v1/system", lambda route: route.fulfill(status=500))
    page = dashboard.until_live()
    expect(page.get_by_text("The service cannot be reached")).not_to_be_attached()
    dashboard.forgive()


def test_a_cable_that_is_pulled_makes_everything_stale_and_heals_when_it_is_plugged_in(dashboard: Dashboard) -> None:
    # What became of the stop of its run is told by the banner, the queue and the run.
    spec = {"name": "long", "trajectory": {"kind": "pause", "duration": 120}}
    number = dashboard.service.robot.post("/experiments", json={"spec": spec}).json()["id"]
    page = dashboard.until_live()
    dashboard.service.until_recording(number)
    dashboard.mock.ask("disconnect")
    undelivered = "the stop could NOT BE DELIVERED"
    expect(page.locator("[data-banner=link]")).to_contain_text(undelivered)
    now = page.get_by_role("region", name="The arm now")
    expect(now).to_contain_text(undelivered)
    now.get_by_role("button", name="Last result").click()
    expect(page.get_by_role("region", name="Result of long")).to_contain_text(undelivered)
    banner = page.get_by_role("banner")
    expect(banner.get_by_text(LIVE).or_(dashboard.degraded)).not_to_be_attached()
    expect(page.get_by_text("stale:")).to_be_visible()
    dashboard.mock.ask("reconnect")
    expect(banner.get_by_text(LIVE).or_(dashboard.degraded)).to_be_visible(timeout=60_000)
    expect(page.get_by_text("stale:")).not_to_be_attached()


def test_a_service_that_hangs_is_missed_and_found_again(dashboard: Dashboard) -> None:
    page = dashboard.until_live()
    with hanging(dashboard.service.process.pid):
        expect(page.get_by_text("No connection to the service.")).to_be_visible()
        expect(page.get_by_role("banner").get_by_text(LIVE)).not_to_be_attached()
        expect(page.get_by_text("stale:")).to_be_visible()
        expect(page.get_by_text("Without a connection it is not known what the arm does.")).to_be_visible()
    expect(page.get_by_text("No connection to the service.")).not_to_be_attached()
    expect(page.get_by_role("banner").get_by_text(LIVE).or_(dashboard.degraded)).to_be_visible()
    dashboard.forgive()


def test_a_reset_says_nothing_of_an_arm_that_is_disconnected_and_the_screen_at_the_arm_says_where_to_connect(
    dashboard: Dashboard,
) -> None:
    page = dashboard.until_live()
    page.keyboard.press("F8")
    page.get_by_role("button", name="Reset").click()
    reset = page.locator("[data-banner=reset]")
    expect(reset).to_contain_text("holds its posture")
    dashboard.service.robot.post("/disconnect")
    expect(reset).not_to_be_attached()
    dashboard.open("kiosk")
    page.locator(".state").get_by_role("link", name="Live").click()
    page.get_by_role("button", name="Connect").click()
    expect(page.get_by_text("The queue is paused")).to_be_visible()
    expect(reset).not_to_be_attached()
