"""Console, macros and the plan, from what is typed to what the queue has."""

import re
from datetime import UTC, datetime, timedelta

import pytest
from playwright.sync_api import expect

from tests.repository.tracked import ROOT
from tests.server.dashboard.browser import Dashboard
from tests.server.dashboard.faults import faults_of

pytestmark = [
    pytest.mark.browser,
    pytest.mark.skipif(not (ROOT / "extras").exists(), reason="the desk is an extra"),
]


def test_a_line_is_completed_tried_without_sending_it_and_run(dashboard: Dashboard) -> None:
    robot = dashboard.service.robot
    robot.post("/queue/pause", json={})
    page = dashboard.open("experiments/console")
    line = page.get_by_role("combobox", name="Line")
    line.press_sequentially("ru")
    line.press("Tab")
    line.press_sequentially("ra")
    line.press("Tab")
    expect(line).to_have_value("run ramp ")
    line.press_sequentially("--jo")
    line.press("Tab")
    line.press_sequentially("2")
    expect(page.get_by_role("option", name="2 Joints")).to_be_visible()
    assert faults_of(page) == []
    page.get_by_role("button", name="Dry run").click()
    log = page.get_by_role("log")
    expect(log.get_by_text("no limit is violated; nothing was sent")).to_be_visible()
    expect(log.get_by_text(re.compile(r"^joint 2: from \d+\.\d°, between"))).to_be_visible()
    assert robot.get("/queue/experiments").json() == []
    line.press("ArrowUp")
    expect(line).to_have_value("run ramp --joints 2")
    line.press("Enter")
    expect(log.get_by_text("ramp was added to the queue")).to_be_visible()
    expect(log.get_by_text("Paused:")).to_be_visible()
    assert [one["spec"]["joints"] for one in robot.get("/queue/experiments").json()] == [[2]]
    line.fill("run ramp --jonts 2")
    line.press("Enter")
    expect(log.get_by_text("no such option: --jonts")).to_be_visible()
    dashboard.forgive()  # the browser reports the refusal, too
    for place in ("#/traces", "#/experiments/console"):
        page.evaluate("(place) => (location.hash = place)", place)
    expect(log.get_by_text("no such option: --jonts")).to_be_visible()
    line.fill("stop")
    line.press("Enter")
    expect(page.locator("[role=alert] [data-stop=confirmed]")).to_be_visible()


def test_an_experiment_becomes_a_macro_whose_form_keeps_to_its_bounds(dashboard: Dashboard) -> None:
    robot = dashboard.service.robot
    spec = {"name": "seed", "joints": [2], "trajectory": {"kind": "step", "amplitude": 0.05}, "hold": 0.2}
    made = robot.post("/experiments", json={"spec": spec}).json()
    dashboard.service.end_of(made["id"])
    robot.post("/queue/pause", json={})
    page = dashboard.open("experiments")
    page.get_by_role("link", name=re.compile("Keep as macro.*seed")).first.click()
    page.get_by_role("textbox", name="Name", exact=True).fill("two-steps")
    page.get_by_role("button", name=re.compile("^amplitude .* parameter")).click()
    bounds = page.get_by_role("group", name="{amplitude}")
    bounds.get_by_role("textbox", name="To").fill("6")
    bounds.get_by_role("textbox", name="To").blur()
    lines = page.get_by_role("textbox", name="Lines")
    lines.fill(f"{lines.input_value()}\nrun preset ramp")
    lines.blur()
    assert faults_of(page) == []
    page.get_by_role("button", name="Keep", exact=True).click()
    amplitude = page.get_by_role("textbox", name="Amplitude")
    expect(page.get_by_text("two-steps is kept")).to_be_visible()
    amplitude.fill("7")
    expect(page.get_by_text(re.compile("allowed: .*6°"))).to_be_visible()
    expect(page.get_by_role("button", name="Add to the queue")).to_be_disabled()
    amplitude.fill("5")
    page.get_by_role("button", name="Dry run").click()
    checked = page.get_by_text("no limit is violated; nothing was sent")
    expect(checked).to_be_visible()
    amplitude.fill("4")
    expect(checked).to_have_count(0)
    page.get_by_role("button", name="Add to the queue").click()
    expect(page.get_by_text("2 of 2 were added, in this order")).to_be_visible()
    assert faults_of(page) == []
    names = [one["spec"]["name"] for one in robot.get("/queue/experiments").json()]
    assert names == ["seed", "ramp"]
    page.get_by_role("link", name="Console").click()
    line = page.get_by_role("combobox", name="Line")
    line.fill("macro run two-steps --amplitude 3")
    page.get_by_role("button", name="Dry run").click()
    expect(page.get_by_role("log").get_by_text("no limit is violated; nothing was sent")).to_be_visible()
    page.get_by_role("link", name="Macros").click()
    page.get_by_role("button", name="Delete").click()
    page.get_by_role("button", name="Delete it for everybody").click()
    expect(page.get_by_text("No macro is kept yet")).to_be_visible()


def test_the_plan_shows_what_will_be_due_and_that_it_waits_for_the_queue(dashboard: Dashboard) -> None:
    robot = dashboard.service.robot
    robot.post("/queue/pause", json={})
    body = {"spec": {"name": "nightly"}, "cron": "0 2 * * *", "zone": "UTC"}
    made = robot.post("/schedules", json=body).json()
    later = (datetime.now(UTC) + timedelta(days=2)).isoformat()
    robot.post("/experiments", json={"spec": {"name": "once"}, "at": later})
    page = dashboard.open("experiments/plan")
    days = page.get_by_role("list", name="Days")
    expect(days.get_by_role("button", name=re.compile("nightly"))).to_have_count(7 - (datetime.now(UTC).hour >= 2))
    expect(page.get_by_role("main").get_by_text("Paused:")).to_be_visible()
    days.get_by_role("button", name=re.compile("once")).click()
    expect(page.get_by_role("heading", name="Preview")).to_be_visible()
    expect(page.get_by_text("planned by you")).to_be_visible()
    assert faults_of(page) == []
    page.get_by_role("button", name="Turn off").click()
    expect(days.get_by_role("button", name=re.compile("nightly"))).to_have_count(0)
    page.get_by_role("button", name="Delete the schedule of nightly").click()
    expect(page.get_by_role("heading", name="Schedules")).to_have_count(0)
    assert robot.get("/schedules").json()["items"] == []
    assert robot.get("/schedules/" + made["id"]).status_code == 404
