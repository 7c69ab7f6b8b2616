"""The page of models: where they come from, what is known of them, and jobs begun, followed and ended there."""

import re

import pytest
from playwright.sync_api import expect

from tests.server.dashboard.browser import TABLET, WIDE, Dashboard, row_of
from tests.server.dashboard.faults import faults_in_both_schemes
from tests.server.dashboard.studied import Studied

pytestmark = [pytest.mark.browser, pytest.mark.slow, pytest.mark.timeout(600)]


def test_the_tree_leads_from_the_machine_to_the_model_by_keyboard(
    studied: Studied, studied_dashboard: Dashboard
) -> None:
    page = studied_dashboard.open("models")
    tree = page.get_by_role("tree", name="Lineage of models")
    items = tree.get_by_role("treeitem")
    expect(items.first).to_have_attribute("aria-selected", "true")
    items.first.focus()
    page.keyboard.press("ArrowRight")
    expect(items.nth(1)).to_be_focused()
    expect(items.nth(1)).to_contain_text("Fit")
    expect(items.nth(1)).to_contain_text("ramp, ")  # traces are known by name and time
    page.keyboard.press("ArrowRight")
    expect(items.nth(2)).to_be_focused()
    page.keyboard.press("Enter")
    expect(page.get_by_role("region", name="first fit")).to_contain_text(studied.model)
    expect(items.nth(2)).to_have_attribute("aria-selected", "true")
    assert page.url.endswith(f"#/models/{studied.model}")
    count = items.count()
    page.keyboard.press("ArrowLeft")
    expect(items.nth(2)).to_have_attribute("aria-expanded", "false")
    assert items.count() < count


def test_parameters_have_their_intervals_and_say_what_is_not_known(
    studied: Studied, studied_dashboard: Dashboard
) -> None:
    found = studied.result(studied.fit)
    verdicts = [one["verdict"] for one in found["parameters"]]
    page = studied_dashboard.open(f"models/{studied.model}")
    panel = page.get_by_role("region", name=re.compile("^Parameters"))
    expect(panel).to_contain_text(f"{verdicts.count('known')} of {len(verdicts)} known")
    expect(panel.get_by_text("not identifiable")).to_have_count(verdicts.count("unknown"))
    expect(panel.get_by_text("only in combination")).to_have_count(verdicts.count("combination"))
    panel.get_by_role("checkbox", name="show all parameters").check()
    expect(panel.get_by_role("rowheader", name="link 1")).to_be_visible()


def test_the_validation_shows_its_sum_and_its_curves(studied: Studied, studied_dashboard: Dashboard) -> None:
    found = studied.result(studied.validation)["fidelity"]
    page = studied_dashboard.open(f"models/{studied.model}")
    panel = page.get_by_role("region", name=re.compile("^Validation by distortion"))
    strongest = max(found["parameters"], key=lambda one: one["contribution"])
    bar = panel.get_by_role("img", name=re.compile("^Σλ²"))
    expect(bar).to_have_accessible_name(re.compile(re.escape(strongest["name"])))
    curves = panel.get_by_role("img", name=re.compile("^Error against"))
    expect(curves.first).to_be_visible()
    if (more := panel.get_by_role("button", name=re.compile("^All .* curves"))).count():
        more.click()
    expect(curves).to_have_count(len(found["curves"]))


def test_a_comparison_is_begun_here_and_its_result_shown(studied: Studied, studied_dashboard: Dashboard) -> None:
    page = studied_dashboard.open(f"models/{studied.model}")
    page.get_by_role("button", name="Compare…").click()
    row_of(page, studied.traces[1]).get_by_role("radio", name="Use", exact=True).check()
    page.get_by_role("button", name="Start", exact=True).click()
    expect(page.get_by_role("region", name=re.compile("^Agreement"))).to_be_visible()
    expect(page.get_by_role("img", name=re.compile("^Position of joint 1"))).to_be_visible()
    expect(page.get_by_role("tree")).to_contain_text("Simulation")
    job = page.url.rpartition("/")[2]
    assert studied.service.robot.get(f"/jobs/{job}").json()["request"]["models"] == ["machine", studied.model]


def test_a_job_is_followed_and_cancelled(studied: Studied, studied_dashboard: Dashboard) -> None:
    page = studied_dashboard.open("models")
    sent = studied.service.robot.post(
        "/jobs", json={"kind": "diagnose", "most_steps": 3, "traces": list(studied.traces)}
    )
    job = sent.json()["id"]
    computing = page.get_by_role("region", name="Computing")
    expect(computing).to_contain_text("Diagnosis")
    expect(computing.get_by_role("progressbar", name="Diagnosis")).to_be_attached()
    computing.get_by_role("button", name="Cancel").click()
    expect(computing).to_have_count(0)
    assert studied.service.robot.get(f"/jobs/{job}").json()["state"] == "cancelled"


def test_what_the_service_refuses_is_said_beside_the_form(studied: Studied, studied_dashboard: Dashboard) -> None:
    page = studied_dashboard.open("models/machine")
    page.get_by_role("button", name="Fit…").click()
    row_of(page, studied.traces[0]).get_by_role("radio", name="Fit to").check()
    page.get_by_label("Name of the new model").fill("/no/such name/")
    page.get_by_role("button", name="Start", exact=True).click()
    expect(page.get_by_role("alert").filter(has_text="name")).to_be_visible()
    expect(page.get_by_role("button", name="Start", exact=True)).to_be_enabled()
    studied_dashboard.forgive()


def test_axe_finds_no_fault_in_a_model_and_it_fits_a_tablet(studied: Studied, studied_dashboard: Dashboard) -> None:
    page = studied_dashboard.open(f"models/{studied.model}")
    page.set_viewport_size(TABLET)
    expect(page.get_by_role("region", name=re.compile("^Validation"))).to_be_visible()
    assert page.evaluate("document.documentElement.scrollWidth <= innerWidth")
    page.set_viewport_size(WIDE)
    page.get_by_role("button", name="Fit…").click()
    expect(page.get_by_role("button", name="Start", exact=True)).to_be_visible()
    assert faults_in_both_schemes(page) == []
