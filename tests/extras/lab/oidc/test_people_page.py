"""Signing in on the page, and approving somebody else's experiment there, in a real Chromium."""

import os
import re
from collections.abc import Iterator
from contextlib import closing, contextmanager
from pathlib import Path

import pytest
from playwright.sync_api import Browser, Page, expect

from server.clock import SystemClock
from tests.extras.lab.oidc.provider import Provider, running_provider
from tests.extras.lab.oidc.test_sign_in import OPERATORS, service_of_people
from tests.server.access.people import SPEC, people_at
from tests.server.dashboard.browser import PATIENCE_MS, WIDE
from tests.server.inside import service_inside
from tests.server.queue.test_review import seems_real

pytestmark = [pytest.mark.browser, pytest.mark.timeout(300)]
NARROW = {"width": 390, "height": 844}


@contextmanager
def _tab(browser: Browser) -> Iterator[Page]:
    with closing(browser.new_context(viewport=WIDE, color_scheme="light")) as context:
        page = context.new_page()
        page.set_default_timeout(PATIENCE_MS)
        yield page


def _fits(page: Page, name: str) -> None:
    """Nothing sticks out at either width, and Stop is whole. With DAQ_PICTURES, pictures are kept in that folder."""
    for size in (WIDE, NARROW):
        page.set_viewport_size(size)  # type: ignore[arg-type]
        expect(page.get_by_role("button", name=re.compile("STOP"))).to_be_in_viewport(ratio=1)
        beyond = "document.documentElement.scrollWidth - document.documentElement.clientWidth"
        assert page.evaluate(beyond) <= 0, f"{name} at {size['width']}"
        if folder := os.environ.get("DAQ_PICTURES"):
            for scheme in ("light", "dark"):
                page.emulate_media(color_scheme=scheme)  # type: ignore[arg-type]
                Path(folder, f"{name}-{size['width']}-{scheme}.png").write_bytes(page.screenshot())
            page.emulate_media(color_scheme="light")
    page.set_viewport_size(WIDE)


@pytest.fixture(scope="module")
def provider() -> Iterator[Provider]:
    """One that knows anna, and mallory, who has no role."""
    with running_provider() as found:
        found.person("anna-1", **OPERATORS)
        found.person("mallory", preferred_username="mallory", groups=["staff"])
        yield found


def test_somebody_signs_in_and_out_on_the_page(browser: Browser, provider: Provider, tmp_path: Path) -> None:
    elsewhere = provider.url.replace("127.0.0.1", "localhost")  # another site, as a browser sees it
    with service_of_people(tmp_path, elsewhere) as service, _tab(browser) as page:
        page.goto(service.url)
        link = page.get_by_role("link", name="Sign in with the laboratory")
        expect(link).to_be_visible()
        expect(page.get_by_label("Token")).to_be_visible()
        _fits(page, "sign-in")
        link.click()
        page.locator("input[name=sub]").fill("mallory")
        page.get_by_role("button", name="Authorize").click()
        expect(page.get_by_role("alert").filter(has_text="no role here")).to_be_visible()
        _fits(page, "refused")
        page.get_by_role("link", name="Sign in with the laboratory").click()
        page.locator("input[name=sub]").fill("anna-1")
        page.get_by_role("button", name="Authorize").click()
        account = page.get_by_title("Who you are")
        expect(account).to_contain_text("anna")
        account.click()
        expect(page.get_by_text("operator: moves the arm")).to_be_visible()
        _fits(page, "account")
        page.get_by_role("button", name="Sign out").click()
        page.wait_for_url(re.compile(r"/oauth2/end_session"))
        page.goto(service.url)
        expect(page.get_by_role("link", name="Sign in with the laboratory")).to_be_visible()


def test_a_session_that_ends_leads_to_the_sign_in(browser: Browser, provider: Provider, tmp_path: Path) -> None:
    with service_of_people(tmp_path, provider.url) as service, _tab(browser) as page:
        page.goto(f"{service.url}/api/v1/login/start")
        page.locator("input[name=sub]").fill("anna-1")
        page.get_by_role("button", name="Authorize").click()
        expect(page.get_by_title("Who you are")).to_contain_text("anna")
        headers = {"Origin": service.url}
        assert page.context.request.post(f"{service.url}/api/v1/logout", headers=headers).ok  # in another tab
        expect(page.get_by_role("link", name="Sign in with the laboratory")).to_be_visible()


def test_somebody_else_s_experiment_is_looked_at_and_approved(
    browser: Browser, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    seems_real(monkeypatch)
    with service_inside(tmp_path, SystemClock(), monkeypatch, review="operator") as robot, _tab(browser) as page:
        robot.post("/connect")
        robot.post("/queue/pause")
        people = people_at(robot, tmp_path, {"anna": "operator", "bert": "operator"})
        identity = people["anna"].submit()
        own = people["bert"].submit(spec=SPEC | {"name": "mine"})
        token = people["bert"].headers["Authorization"].removeprefix("Bearer ")
        page.add_init_script(f"sessionStorage.setItem('ma2000-token', '{token}')")
        page.goto(f"http://127.0.0.1:{robot.base_url.port}/#/experiments")
        page.get_by_role("button", name="Look at warm-up").click()
        expect(page.get_by_role("button", name="Look at mine")).to_have_count(0)
        expect(page.get_by_text("not approved: another operator must look at it")).to_have_count(2)
        _fits(page, "review")
        page.get_by_role("button", name="Approve warm-up").click()
        expect(page.get_by_text("approved by bert")).to_be_visible()
        _fits(page, "approved")
        assert robot.get(f"/experiments/{identity}").json()["approval"]["by"] == "bert"
        assert robot.get(f"/experiments/{own}").json()["approval"] is None
