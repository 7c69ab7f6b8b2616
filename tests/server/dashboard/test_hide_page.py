"""The demonstration on the page, from the click to the open secret; and what it refuses."""

import json
import re
import subprocess
import sys
from collections.abc import Iterator
from hashlib import sha256

import pytest
from playwright.sync_api import Browser, expect

from tests.server.dashboard.browser import WIDE, watched
from tests.server.dashboard.faults import faults_of
from tests.server.service import Service, running_service

pytestmark = [pytest.mark.browser, pytest.mark.slow, pytest.mark.timeout(900)]
"""A whole diagnosis is computed."""
LONG_MS = 600_000


@pytest.fixture(scope="module")
def service(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Service]:
    """A service on a mock: a demonstration needs no more."""
    with running_service(tmp_path_factory.mktemp("hiding"), "mock://?pty=1&lock_step=1") as service:
        service.until_connected()
        yield service


def test_what_the_mock_hides_is_looked_for_and_its_seal_holds(browser: Browser, service: Service) -> None:
    context = browser.new_context(viewport=WIDE, reduced_motion="reduce")
    tab = watched(context, service)
    page = tab.open("diagnosis")
    page.get_by_role("link", name=re.compile("Hide something from me")).click()
    page.get_by_text("Choose yourself what is hidden").click()
    page.get_by_role("combobox", name="Effect").select_option("viscous_friction")
    page.get_by_role("combobox", name="Joint").select_option("2")
    page.get_by_role("button", name="Hide this").click()
    expect(page.get_by_text("The secret is sealed")).to_be_visible()
    assert faults_of(page) == []
    sealed = service.robot.get("/hidden").json()["latest"]
    assert sealed["secret"] is None
    expect(page.get_by_text("not live")).to_be_visible(timeout=LONG_MS)
    expect(page.get_by_role("list", name="Candidates, the best first")).to_be_visible(timeout=LONG_MS)
    expect(page.get_by_text("The secret is open.")).to_be_visible(timeout=LONG_MS)
    assert faults_of(page) == []
    latest = service.robot.get("/hidden").json()["latest"]
    secret, answer = latest["secret"], service.robot.get(f"/jobs/{latest['diagnosis']}/result").json()["data"]
    assert (secret["effect"], secret["joints"]) == ("viscous_friction", [2])
    named = [step["effect"] for step in answer["steps"] if step["adopted"]]
    assert (secret["outcome"] == "named") == (named == ["viscous_friction"])
    told = subprocess.run(
        [sys.executable, "-m", "mock_controller.reveal", str(secret["seed"])], capture_output=True, check=True
    ).stdout
    assert sha256(told).hexdigest() == sealed["seal"]
    hidden = json.loads(told)["effects"][0]["parameters"][0]["coefficient"]
    assert hidden > 0
    expect(page.get_by_role("row").filter(has_text=re.compile("coefficient", re.IGNORECASE))).to_be_visible()
    context.close()
    assert tab.complaints == []


@pytest.mark.parametrize(
    ("body", "said"),
    [
        ({"effect": "gremlins"}, "cannot be hidden; allowed are viscous_friction"),
        ({"effect": "link_mass", "joint": 1}, "allowed is on joints 2, 3"),
        ({"effect": "payload", "joint": 1}, "on the whole arm, without a joint"),
    ],
)
def test_what_cannot_be_hidden_is_refused_in_one_line(service: Service, body: dict[str, object], said: str) -> None:
    refused = service.robot.post("/hidden", json=body)
    assert refused.status_code == 422
    assert said in refused.json()["detail"]
