"""Layouts of the Live page: arranged by pointer and keyboard, kept, shared by link, saved as a file; on a phone too."""

import json
import re
from pathlib import Path
from typing import Any

import pytest
from playwright.sync_api import Locator, Page, expect

from tests.server.dashboard.browser import WIDE, Dashboard, watched
from tests.server.dashboard.faults import faults_of

pytestmark = [pytest.mark.browser, pytest.mark.slow]
PHONE = {"width": 360, "height": 740}
KINDS = ("charts", "chart", "number", "arm", "table", "link", "hand", "faults", "notes")


def _tile(page: Page, title: str) -> Locator:
    return page.locator(".grid-stack-item").filter(has=page.get_by_role("button", name=re.compile(f"^{title}: ")))


def _add(page: Page, title: str) -> None:
    page.get_by_role("combobox", name="Add a panel").select_option(label=title)
    page.get_by_role("button", name="Add", exact=True).press("Enter")


def _places(page: Page) -> dict[str, dict[str, float]]:
    found: dict[str, dict[str, float]] = page.evaluate(
        """() => Object.fromEntries([...document.querySelectorAll('.place[data-kind]')].map((one) =>
            [one.dataset.kind, one.getBoundingClientRect().toJSON()]))"""
    )
    return found


def test_a_layout_is_arranged_kept_shared_and_saved(dashboard: Dashboard, tmp_path: Path) -> None:
    page = dashboard.until_live()
    page.get_by_role("button", name="Arrange panels").click()
    for title in ("Number", "Chart", "Notes", "Faults"):
        _add(page, title)
    expect(page.get_by_role("button", name=re.compile("^Faults: "))).to_be_focused()
    expect(page.get_by_role("button", name=re.compile("^Faults: "))).to_be_in_viewport()
    _tile(page, "Number").get_by_role("combobox", name="Joint").select_option("J2")
    handle = page.get_by_role("button", name=re.compile("^Number: "))
    handle.focus()
    for key in ("ArrowRight", "ArrowRight", "Shift+ArrowRight", "Shift+ArrowDown"):
        page.keyboard.press(key)
    expect(page.get_by_role("status").filter(has_text="Number: column 3, row")).to_contain_text("3 wide, 5 high")
    moved = _tile(page, "By hand").locator(".bar")
    moved.evaluate("one => one.scrollIntoView({ block: 'center' })")
    bar = moved.bounding_box()
    assert bar is not None
    page.mouse.move(bar["x"] + bar["width"] / 2, bar["y"] + bar["height"] / 2)
    page.mouse.down()
    page.mouse.move(bar["x"] + bar["width"] / 2, bar["y"] + 300, steps=8)
    page.mouse.up()
    page.get_by_role("button", name="Remove Link").click()
    expect(page.get_by_role("button", name=re.compile("^Number: "))).to_be_focused()  # the next one
    page.keyboard.press("Escape")
    expect(page.get_by_role("status").filter(has_text="Nothing is saved yet")).to_be_visible()
    assert all(page.locator(".body").evaluate_all("all => all.map((one) => one.inert)"))  # nothing moves the arm
    assert faults_of(page) == []
    page.get_by_label("Name of the layout").fill("Bench")
    page.get_by_role("button", name="Save").click()
    page.get_by_role("textbox", name="Notes").fill("payload 2 kg")
    page.reload()
    expect(page.get_by_role("combobox", name="Layout")).to_have_value("Bench")
    expect(page.get_by_role("textbox", name="Notes")).to_have_value("payload 2 kg")
    expect(page.get_by_role("heading", name=re.compile("^J2 position"))).to_have_count(2)
    expect(page.locator("[data-kind=link]")).to_have_count(0)
    places = _places(page)
    assert places["number"]["left"] > places["charts"]["left"]
    assert places["hand"]["top"] >= places["charts"]["bottom"]  # what is below a removed panel rises
    assert faults_of(page) == []
    _see_it_elsewhere(dashboard, page, tmp_path)
    page.get_by_role("button", name="Arrange panels").click()
    expect(page.get_by_role("heading", name="Arrange panels")).to_be_focused()
    page.keyboard.press("Escape")
    expect(page.get_by_role("button", name="Arrange panels")).to_be_focused()
    page.keyboard.press("Enter")
    page.get_by_role("button", name="Delete").click()
    expect(page.locator("[data-kind=link]")).to_be_visible()


def _see_it_elsewhere(dashboard: Dashboard, page: Page, folder: Path) -> None:
    """Who opens the link, or takes the file, sees the same panels; their own layout stays as it is."""
    page.get_by_role("button", name="Arrange panels").click()
    page.context.grant_permissions(["clipboard-read", "clipboard-write"])
    page.get_by_role("button", name="Copy link").click()
    expect(page.get_by_text("The link is in the clipboard")).to_be_visible()
    link = page.evaluate("navigator.clipboard.readText()")
    with page.expect_download() as saving:
        page.get_by_role("button", name="Export").click()
    file = folder / saving.value.suggested_filename
    saving.value.save_as(file)
    saved: dict[str, Any] = json.loads(file.read_text("utf-8"))
    assert {"kind": "notes", "text": "payload 2 kg"}.items() <= next(
        one for one in saved["panels"] if one["kind"] == "notes"
    ).items()
    page.get_by_role("button", name="Cancel").click()
    browser = page.context.browser
    assert browser is not None
    context = browser.new_context(viewport=WIDE)
    tab = watched(context, dashboard.service)
    tab.page.goto(link)
    expect(tab.page.get_by_text("Shared layout “Bench”")).to_be_visible()
    assert _places(tab.page).keys() == _places(page).keys()
    tab.page.get_by_role("button", name="Back to mine").click()
    expect(tab.page.get_by_text("Shared layout")).to_have_count(0)
    expect(tab.page.get_by_role("combobox", name="Layout")).to_have_value("Bench")  # the service has it for this person
    tab.page.get_by_role("combobox", name="Layout").select_option("Standard")
    expect(tab.page.locator("[data-kind=link]")).to_be_visible()
    tab.page.get_by_role("button", name="Arrange panels").click()
    wrong = folder / "wrong.json"
    wrong.write_text(json.dumps(saved | {"panels": [{"kind": "gauge"}]}), "utf-8")
    tab.page.get_by_label("File of a layout").set_input_files(wrong)
    expect(tab.page.get_by_role("alert").filter(has_text="Panel 1: its kind is")).to_be_visible()
    tab.page.get_by_label("File of a layout").set_input_files(file)
    expect(tab.page.get_by_role("combobox", name="Layout")).to_have_value("Bench 2")
    context.close()
    assert tab.complaints == []


def test_a_phone_arranges_by_order_and_shows_every_kind(dashboard: Dashboard) -> None:
    page = dashboard.page
    layout = {
        "format": "ma2000-layout",
        "name": "Every kind",
        "panels": [
            {"kind": kind, "x": 0, "y": 9 * index, "w": 8, "h": 9} for index, kind in enumerate((*KINDS, "plugin"))
        ],
    }
    layout["panels"][-1]["of"] = "Gone"  # type: ignore[index]
    page.set_viewport_size(PHONE)  # type: ignore[arg-type]
    dashboard.until_live()
    page.get_by_role("button", name="Arrange panels").click()
    page.get_by_label("File of a layout").set_input_files(
        {"name": "every.json", "mimeType": "application/json", "buffer": json.dumps(layout).encode()}
    )
    expect(page.get_by_text("no plug-in with the panel “Gone”")).to_be_visible()
    expect(page.locator(".place[data-kind]")).to_have_count(len(KINDS) + 1)
    assert page.evaluate("document.documentElement.scrollWidth <= innerWidth")
    assert faults_of(page) == []
    page.get_by_role("button", name="Arrange panels").click()
    assert faults_of(page) == []
    page.get_by_role("button", name="Notes up").click()
    page.get_by_role("button", name="Save").click()
    kinds = page.locator(".place[data-kind]").evaluate_all("all => all.map((one) => one.dataset.kind)")
    assert kinds.index("notes") < kinds.index("faults")
