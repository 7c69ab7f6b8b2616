"""Every page, light and dark: nothing that axe finds fault with; usable with the keyboard alone."""

import pytest
from playwright.sync_api import Browser, expect

from tests.server.dashboard.browser import WIDE, Dashboard, MockControl, watched
from tests.server.dashboard.faults import faults_in_both_schemes, faults_of
from tests.server.dashboard.test_stop import PAGES
from tests.server.service import Service

pytestmark = pytest.mark.browser


def test_axe_finds_no_fault_on_any_page_light_or_dark(browser: Browser, served: tuple[Service, MockControl]) -> None:
    context = browser.new_context(viewport=WIDE)
    tab = watched(context, *served)
    found = []
    for path in PAGES:
        page = tab.open(path)
        page.wait_for_load_state("networkidle")
        found += [f"{path}, {fault}" for fault in faults_in_both_schemes(page)]
    context.close()
    assert found == []
    assert tab.complaints == []


def test_the_keyboard_reaches_every_page_and_skips_what_is_repeated(dashboard: Dashboard) -> None:
    page = dashboard.until_live()
    page.keyboard.press("Tab")
    expect(page.get_by_role("link", name="Skip to the content")).to_be_focused()
    page.keyboard.press("Tab")
    expect(page.get_by_role("link", name="Live", exact=True)).to_be_focused()
    for name in ("Experiments", "Traces", "Models", "Diagnosis", "System"):
        page.keyboard.press("Tab")
        expect(page.get_by_role("link", name=name, exact=True)).to_be_focused()
    page.keyboard.press("Enter")
    expect(page.get_by_role("heading", level=1, name="System")).to_be_visible()
    page.keyboard.press("?")
    keys = page.get_by_role("region", name="Keys")
    expect(keys).to_contain_text("F8")
    assert faults_of(page) == []
    page.get_by_role("button", name="STOP").click(trial=True)  # the list blocks nothing
    page.keyboard.press("Escape")
    expect(keys).not_to_be_visible()
    page.keyboard.press("g")
    page.keyboard.press("t")
    expect(page.get_by_role("heading", level=1, name="Traces")).to_be_attached()
    line = page.get_by_role("search").get_by_role("combobox")
    expect(line).to_be_visible()
    page.keyboard.press("/")
    expect(line).to_be_focused()


def test_the_theme_is_the_systems_until_it_is_chosen_and_the_choice_is_kept(dashboard: Dashboard) -> None:
    page = dashboard.until_live()
    root = page.locator("html")
    expect(root).to_have_attribute("data-theme", "light")
    page.emulate_media(color_scheme="dark")
    expect(root).to_have_attribute("data-theme", "dark")
    page.get_by_role("button", name="Switch to light").click()
    expect(root).to_have_attribute("data-theme", "light")
    page.reload()
    expect(root).to_have_attribute("data-theme", "light")
