"""In every test run: a motion is written into the form, is followed while it runs, and its trace is looked at."""

import re

import pytest
from playwright.sync_api import expect

from tests.server.dashboard.browser import Dashboard

pytestmark = pytest.mark.browser


def test_a_ramp_is_started_from_the_form_and_its_trace_appears(dashboard: Dashboard) -> None:
    form = dashboard.open("experiments")
    form.get_by_role("textbox", name="Amplitude", exact=False).first.fill("5")
    form.get_by_role("textbox", name="Duration").fill("0.5")
    form.get_by_role("textbox", name="Hold before").fill("0.2")
    form.get_by_role("textbox", name="Hold after").fill("0.2")
    form.get_by_role("textbox", name="Name").fill("from-the-form")
    expect(form.get_by_text("motion within its limits")).to_be_visible()
    form.get_by_role("button", name="Add to the queue").click()
    own = form.locator("section", has=form.get_by_role("heading", name="Your run"))
    expect(own.get_by_text("done", exact=True)).to_be_visible()
    expect(own.get_by_role("img", name="Change of position and set point of joints 1, 2, 3")).to_be_visible()
    expect(own.get_by_role("columnheader", name="Overshoot")).to_be_visible()
    assert own.get_by_role("row").count() == 4  # its head, and the joints that moved
    expect(own.get_by_role("link", name="Diagnose a model with it")).to_be_visible()
    own.get_by_role("link", name="Open the trace").click()
    expect(form.get_by_role("img", name=re.compile("Position and set point.*joint 1, 2, 3")).first).to_be_visible()
    entry = dashboard.service.robot.get("/traces").json()["items"][0]
    assert (entry["name"], entry["outcome"]) == ("from-the-form", "complete")
    trajectory = dashboard.service.robot.get(f"/traces/{entry['id']}").json()["record"]["spec"]["trajectory"]
    assert trajectory["amplitude"] == pytest.approx(0.0872664626)
    assert trajectory["duration"] == 0.5
