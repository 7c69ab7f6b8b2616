"""The page of diagnoses: one begun from chosen traces, followed, told as a story, and its next experiment queued."""

import re
from math import degrees
from pathlib import Path
from typing import Any

import pytest
from playwright.sync_api import Page, expect

from tests.server.dashboard.browser import TABLET, WIDE, Dashboard, row_of
from tests.server.dashboard.faults import faults_in_both_schemes, faults_of
from tests.server.dashboard.studied import Studied

pytestmark = [pytest.mark.browser, pytest.mark.slow, pytest.mark.timeout(600)]
"""What `studied` has is computed once, before the first test."""


def test_a_diagnosis_is_begun_followed_and_ended(studied: Studied, studied_dashboard: Dashboard) -> None:
    page = studied_dashboard.open("diagnosis")
    begin = page.get_by_role("button", name="Diagnose", exact=True)
    expect(begin).to_be_disabled()
    first, second = (row_of(page, trace) for trace in studied.traces)
    first.get_by_role("radio", name="Fit to").check()
    expect(page.get_by_text("Hold out a trace too")).to_be_visible()
    second.get_by_role("radio", name="Hold out").check()
    page.get_by_role("checkbox", name="2", exact=True).check()
    page.get_by_label("Most effects to add").fill("1")
    page.get_by_text("Effects to look for").click()
    page.get_by_role("checkbox", name=re.compile("^Coulomb friction")).check()
    begin.click()
    expect(page.get_by_role("heading", level=1, name="Diagnosing")).to_be_visible()
    job = page.url.rpartition("/")[2]
    request = studied.service.robot.get(f"/jobs/{job}").json()["request"]
    assert (request["traces"], request["held_out"]) == ([studied.traces[0]], [studied.traces[1]])
    assert (request["joints"], request["effects"], request["most_steps"]) == ([2], ["coulomb_friction"], 1)
    expect(page.get_by_role("progressbar")).to_be_visible()
    page.get_by_role("button", name="Cancel").click()
    expect(page.get_by_role("heading", level=1, name="No answer")).to_be_visible()
    assert studied.service.robot.get(f"/jobs/{job}").json()["state"] == "cancelled"
    page.get_by_role("button", name="Delete").click()
    page.get_by_role("button", name="permanently").click()
    expect(page.get_by_role("link", name=re.compile("^Coulomb friction"))).to_have_count(1)


def test_the_answer_is_told_with_the_numbers_that_were_found(
    studied: Studied, studied_dashboard: Dashboard, tmp_path: Path
) -> None:
    found = studied.result(studied.diagnosis)
    assert found["verdict"] == "named", found["summary"]
    (step,) = found["steps"]
    page = studied_dashboard.open("diagnosis")
    page.get_by_role("link", name=re.compile("Coulomb friction on joint 2")).click()
    expect(page.get_by_role("heading", level=1)).to_have_text(re.compile("^Coulomb friction on joint 2, "))
    expect(page.get_by_text(found["summary"][1:]).first).to_be_visible()
    _see_the_story(page, found, tmp_path / "report.html")
    page.get_by_role("button", name="Everything behind it").click()
    _see_the_map(page, found["given"])
    best = page.get_by_role("region", name="Candidates evidence").get_by_role("listitem").filter(has_text="named")
    expect(best).to_contain_text(f"{step['evidence'] + (step['evidence_held_out'] or 0.0):.0f}")
    expect(page.get_by_text("explains", exact=False).first).to_be_attached()
    (value,) = step["parameters"].values()
    expect(page.get_by_text("95 % interval").first).to_contain_text(f"{value['low']:.4g}"[:4])
    gap = page.get_by_role("region", name="The gap, step by step")
    gap.get_by_text("As a table").click()
    after = degrees(found["gap"]["stages"][-1]["held_out"][1])
    expect(gap.get_by_role("row").filter(has_text="held out").nth(1)).to_contain_text(f"{after:.3g}"[:5])
    overlay = page.get_by_role("region", name="Measured, before and after")
    expect(overlay.get_by_role("img", name=re.compile("^Position of joint 2"))).to_be_visible()
    overlay.get_by_role("combobox", name="Joint").select_option("3")
    expect(overlay.get_by_role("img", name=re.compile("^Measured minus simulated position of joint 3"))).to_be_visible()


def _see_the_story(page: Page, found: dict[str, Any], report: Path) -> None:
    """Where, what, how much and what next; and the same in a saved file, which opens without the service."""
    what, shrinks = (page.get_by_role("region", name=name) for name in ("What candidates", "How much it shrinks"))
    expect(what.get_by_role("listitem").first).to_contain_text("Coulomb friction, joint 2")
    after = degrees(found["gap"]["stages"][-1]["held_out"][1])
    expect(shrinks.get_by_role("listitem").nth(1)).to_contain_text(f"{after:.2g}")
    expect(page.get_by_role("img", name=re.compile("joint 2 not explained"))).to_be_visible()
    page.get_by_role("button", name="with what was found").click()
    expect(page.get_by_role("img", name=re.compile("joint 2 explained"))).to_be_visible()
    with page.expect_download() as saving:
        page.get_by_role("button", name="Report").click()
    saving.value.save_as(report)
    saved = page.context.new_page()
    saved.goto(report.as_uri())
    expect(saved.get_by_role("heading", level=1)).to_have_text(re.compile("^Coulomb friction on joint 2, "))
    expect(saved.get_by_role("region", name="How much it shrinks").get_by_role("listitem")).to_have_count(3)
    expect(saved.locator("main")).to_contain_text(re.compile(r", \d\d \w{3} \d{4}, \d\d:\d\d:\d\d"))
    assert faults_of(saved) == []
    saved.close()


def _see_the_map(page: Page, given: dict[str, object]) -> None:
    where = given["where"]
    assert isinstance(where, dict)
    region = page.get_by_role("region", name="Where they disagree")
    expect(region.get_by_role("img", name=re.compile("^Map of disagreement"))).to_be_visible()
    region.get_by_text("As a table").click()
    pairs = {(cell["joint"], cell["phase"]) for cell in where["cells"]}
    expect(region.get_by_role("row")).to_have_count(1 + len(pairs))
    region.get_by_role("combobox").select_option(index=1)
    expect(region).to_contain_text("standard deviations count")


def test_the_proposed_experiment_is_queued(studied: Studied, studied_dashboard: Dashboard) -> None:
    asked = studied.result(studied.asking)["next_experiment"]
    assert asked is not None
    page = studied_dashboard.open(f"diagnosis/{studied.asking}")
    page.get_by_role("button", name="Queue this experiment").click()
    expect(page.get_by_text("waits: the queue is paused")).to_be_visible()
    (queued,) = studied.service.robot.get("/queue/experiments").json()
    assert queued["spec"]["name"] == asked["spec"]["name"]
    assert queued["spec"]["trajectory"] == asked["spec"]["trajectory"]
    expect(page.get_by_role("link", name=f"Experiment {asked['spec']['name']}", exact=True)).to_be_visible()
    studied.service.robot.post(f"/experiments/{queued['id']}/cancel")


def test_a_diagnosis_that_is_not_there_is_said(studied_dashboard: Dashboard) -> None:
    page = studied_dashboard.open("diagnosis/000000000000")
    expect(page.get_by_role("alert").filter(has_text="000000000000")).to_be_visible()
    studied_dashboard.forgive()


def test_axe_finds_no_fault_in_an_answer_and_it_fits_a_tablet(studied: Studied, studied_dashboard: Dashboard) -> None:
    page = studied_dashboard.open(f"diagnosis/{studied.diagnosis}")
    page.get_by_role("button", name="Everything behind it").click()
    expect(page.get_by_role("region", name="Remarks")).to_be_attached()
    page.set_viewport_size(TABLET)
    expect(page.get_by_role("region", name="Candidates evidence")).to_be_visible()
    assert page.evaluate("document.documentElement.scrollWidth <= innerWidth")
    page.set_viewport_size(WIDE)
    for summary in page.get_by_text("As a table").all():
        summary.click()
    assert faults_in_both_schemes(page) == []
