"""Stop, from the page: at once, from everywhere, and with the truth about what became of it."""

import os
import re
import signal
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

import pytest
from playwright.sync_api import Page, Route, expect

from tests.server.dashboard.browser import TABLET, TABLET_ON_ITS_SIDE, Dashboard
from tests.server.polling import reset

pytestmark = pytest.mark.browser
CONFIRMED = "[role=alert] [data-stop=confirmed]"
PAGES = (
    *("live", "experiments", "experiments/macros", "experiments/plan", "experiments/console"),
    *("traces", "models", "diagnosis", "system", "kiosk"),
)


@contextmanager
def hanging(process: int) -> Iterator[None]:
    """The process does nothing at all meanwhile."""
    os.kill(process, signal.SIGSTOP)
    try:
        yield
    finally:
        os.kill(process, signal.SIGCONT)


def stop_listener(service: int) -> int:
    """The process at the service's other door."""
    for status in Path("/proc").glob("[0-9]*/status"):
        with suppress(OSError):  # it has ended meanwhile
            words = (status.parent / "cmdline").read_bytes().split(b"\0")
            if b"server.stopping" in words and f"PPid:\t{service}\n" in status.read_text("utf-8"):
                return int(status.parent.name)
    raise AssertionError("no stop listener runs")


def held(page: Page, address: str) -> list[Route]:
    """Requests to an address, as they come: none goes on by itself."""
    found: list[Route] = []

    def hold(route: Route) -> None:
        found.append(route)

    page.route(address, hold)
    return found


def until_one(page: Page, requests: list[Route]) -> None:
    """Until the page has asked; the test's own time limit ends the wait."""
    while not requests:
        page.wait_for_timeout(20)


def test_a_pressed_stop_freezes_the_board_before_it_is_let_go_and_is_past_once_somebody_has_ended_it(
    dashboard: Dashboard,
) -> None:
    page = dashboard.until_live()
    assert not dashboard.mock.ask("state")["frozen"]
    button = page.get_by_role("button", name="STOP")
    button.hover()
    page.evaluate("navigator.vibrate = (ms) => (window.felt = ms)")
    page.mouse.down()
    expect(page.locator(CONFIRMED)).to_be_visible()
    assert page.evaluate("window.felt") > 0
    assert dashboard.mock.ask("state")["frozen"]
    page.mouse.up()
    expect(page.locator(CONFIRMED)).to_contain_text(
        re.compile(r"Stopped at [\d:]+, confirmed by the board after \d+ ms")
    )
    expect(page.locator("[data-stop]").get_by_text("The arm is stopped.")).to_be_visible()
    expect(page.locator("[data-banner]")).not_to_be_attached()  # all is said once
    assert reset(dashboard.service.robot).status_code == 200
    expect(page.locator("[data-stop=past]")).to_contain_text("Past: stopped at")
    expect(page.locator(CONFIRMED)).not_to_be_attached()


def test_the_key_stops_also_while_somebody_types(dashboard: Dashboard) -> None:
    page = dashboard.until_live()
    page.get_by_role("button", name="Take control").click()
    page.get_by_label("Wait").focus()
    page.keyboard.press("F8")
    expect(page.locator(CONFIRMED)).to_be_visible()
    assert dashboard.mock.ask("state")["frozen"]
    page.get_by_role("button", name="Release control").click()
    expect(page.get_by_role("button", name="Take control")).to_be_visible()


def test_stop_is_on_every_page_also_on_a_tablet(dashboard: Dashboard) -> None:
    for path in PAGES:
        dashboard.open(path)
        button = dashboard.page.get_by_role("button", name="STOP")
        for size in (TABLET, TABLET_ON_ITS_SIDE):
            dashboard.page.set_viewport_size(size)
            dashboard.page.mouse.wheel(0, 2000)
            expect(button).to_be_in_viewport(ratio=1)


def test_a_stop_reaches_the_arm_while_the_service_hangs(dashboard: Dashboard) -> None:
    page = dashboard.until_live()
    with hanging(dashboard.service.process.pid):
        page.keyboard.press("F8")
        expect(page.locator(CONFIRMED)).to_be_visible()
        assert dashboard.mock.ask("state")["frozen"]
    dashboard.forgive()


def test_on_the_screen_at_the_arm_stop_stays_where_it_is_and_nothing_releases_the_arm_there(
    dashboard: Dashboard,
) -> None:
    page = dashboard.until_live()
    dashboard.open("kiosk")
    button = page.get_by_role("button", name="STOP")
    before = button.bounding_box()
    for _ in range(4):
        page.mouse.click(before["x"] + 5, before["y"] + 5)
    expect(page.locator(CONFIRMED)).to_be_visible()
    assert button.bounding_box() == before
    assert dashboard.mock.ask("state")["frozen"]
    dashboard.forgive()


def test_a_stop_that_nobody_answers_is_not_called_delivered_and_one_that_arrives_late_is_told(
    dashboard: Dashboard,
) -> None:
    page = dashboard.until_live()
    service = dashboard.service.process.pid
    with hanging(service), hanging(stop_listener(service)):
        page.keyboard.press("F8")
        message = page.locator("[data-stop='not-delivered']")
        expect(message).to_contain_text("Stop NOT DELIVERED")
        expect(message).to_contain_text("Use the emergency stop")
        assert not dashboard.mock.ask("state")["frozen"]
    expect(page.locator(CONFIRMED)).to_be_visible()
    assert dashboard.mock.ask("state")["frozen"]
    dashboard.forgive()


def test_a_reset_ends_the_stop_and_moves_nothing(dashboard: Dashboard) -> None:
    page = dashboard.until_live()
    before = dashboard.mock.ask("state")["set_points"]
    page.keyboard.press("F8")
    expect(page.get_by_text("The arm is stopped.")).to_be_visible()
    page.reload()  # who stopped is known from the events
    expect(page.locator("[data-banner=stopped]")).to_contain_text(re.compile(r"You pressed STOP at [\d:]+\."))
    page.get_by_role("button", name="Reset").focus()
    page.keyboard.press("Enter")
    expect(page.get_by_text("The arm is stopped.")).not_to_be_attached()
    expect(page.locator("[data-banner=reset] p")).to_be_focused()  # which a key does nothing to
    state = dashboard.mock.ask("state")
    assert not state["frozen"]
    assert all(abs(one - other) <= 2 for one, other in zip(before, state["set_points"], strict=True))
    page.get_by_role("button", name="Resume the queue").click()
    expect(page.locator("[data-banner=reset]")).not_to_be_attached()
    dashboard.service.robot.post("/queue/pause", json={})
    expect(page.get_by_text("The queue is paused")).to_be_visible()
    expect(page.locator("[data-banner=reset]")).not_to_be_attached()


def test_a_late_answer_to_a_reset_does_not_hide_a_stop_that_was_pressed_meanwhile(dashboard: Dashboard) -> None:
    page = dashboard.until_live()
    page.keyboard.press("F8")
    expect(page.get_by_text("The arm is stopped.")).to_be_visible()
    resets, stops = held(page, "**/reset"), held(page, "**/robots/*/stop")
    page.get_by_role("button", name="Reset").click()
    until_one(page, resets)
    page.keyboard.press("F8")
    until_one(page, stops)
    with page.expect_response("**/reset"):
        resets[0].continue_()
    expect(page.get_by_text("The arm is stopped.")).not_to_be_attached()
    stops[0].continue_()
    expect(page.locator(CONFIRMED)).to_be_visible()
    assert dashboard.mock.ask("state")["frozen"]
