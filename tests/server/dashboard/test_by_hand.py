"""By hand, on the page: a program that outlives the control and the page, gains, jogging beside the arm."""

from collections.abc import Iterator

import pytest
from playwright.sync_api import Page, expect

from tests.server.dashboard.browser import Dashboard

pytestmark = pytest.mark.browser


@pytest.fixture
def controlled(dashboard: Dashboard) -> Iterator[Page]:
    """The Live page of whoever has the control."""
    yield _in_control(dashboard)
    dashboard.page.get_by_role("button", name="Release control").click()
    expect(dashboard.page.get_by_role("button", name="Take control")).to_be_visible()


def _in_control(dashboard: Dashboard) -> Page:
    page = dashboard.until_live()
    page.get_by_role("button", name="Take control").click()
    expect(page.get_by_role("heading", name="Teach")).to_be_visible()
    return page


def test_a_program_is_there_after_another_page_and_another_control(dashboard: Dashboard, controlled: Page) -> None:
    page, robot = controlled, dashboard.service.robot
    page.get_by_role("button", name="Keep this posture").click()
    page.get_by_role("button", name="Add the wait").click()
    page.get_by_label("Duration of instruction 2").fill("2.5")
    page.get_by_label("Duration of instruction 2").press("Enter")
    page.get_by_label("Name", exact=True).fill("pick")
    page.get_by_label("Name", exact=True).press("Enter")
    expect(page.get_by_text("Wait 2.5 s")).to_be_visible()
    expect(page.get_by_text("Kept by the service")).to_be_visible()
    (entry,) = robot.get("/programs").json()
    assert (entry["name"], entry["instructions"]) == ("pick", 2)

    page.get_by_role("button", name="Release control").click()
    dashboard.open("system")
    page.reload()
    _in_control(dashboard)
    expect(page.get_by_text("Wait 2.5 s")).to_be_visible()
    page.get_by_role("button", name="Move instruction 2 up").click()
    page.get_by_role("button", name="Take instruction 2 away").click()
    expect(page.get_by_text("Kept by the service")).to_be_visible()
    kept = robot.get("/programs/pick").json()["program"]["instructions"]
    assert kept == [{"kind": "wait", "duration": 2.5}]

    page.get_by_role("button", name="Delete", exact=True).click()
    page.get_by_role("button", name="Delete pick for good").click()
    expect(page.get_by_text("they become a program")).to_be_visible()
    assert robot.get("/programs").json() == []


def test_taking_control_stretches_no_chart(dashboard: Dashboard) -> None:
    page = dashboard.until_live()
    charts = page.locator(".place[data-kind=charts]")
    before = charts.evaluate("one => one.offsetHeight")
    page.get_by_role("button", name="Take control").click()
    expect(page.get_by_role("group", name="Jog:")).to_be_visible()
    assert charts.evaluate("one => one.offsetHeight") == before
    page.get_by_role("button", name="Release control").click()
    expect(page.get_by_role("group", name="Jog:")).not_to_be_attached()
    assert charts.evaluate("one => one.offsetHeight") == before


def test_gains_are_changed_and_read_back_and_jogging_is_beside_the_arm(dashboard: Dashboard, controlled: Page) -> None:
    panel = controlled.locator("section").filter(has=controlled.get_by_text("This browser shows no 3-D"))
    expect(panel.get_by_role("group", name="Jog:")).to_be_visible()
    robot = dashboard.service.robot
    before = robot.get("/gains").json()["gains"]["2"]
    field = controlled.get_by_label("P of joint 2", exact=True)
    expect(field).to_have_value(str(before[0]))
    write = controlled.get_by_role("button", name="Write changes")
    expect(write).to_be_disabled()
    field.fill("21")
    expect(field).to_have_attribute("aria-invalid", "true")
    expect(write).to_be_disabled()
    field.fill(str(before[0] + 1))
    write.click()
    expect(controlled.get_by_text("joint 2: written and read back")).to_be_visible()
    assert robot.get("/gains").json()["gains"]["2"] == [before[0] + 1, *before[1:]]
    field.fill(str(before[0]))
    write.click()
    expect(write).to_be_disabled()
    assert robot.get("/gains").json()["gains"]["2"] == before
