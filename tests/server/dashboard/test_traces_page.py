"""The page of traces: found, laid over each other, zoomed, measured, simulated, noted, taken in and out."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import pytest
from playwright.sync_api import Locator, Page, expect

from tests.server.dashboard.browser import TABLET, Dashboard

pytestmark = pytest.mark.browser
RAMP = {"kind": "ramp", "amplitude": 0.1, "duration": 0.3}


@pytest.fixture
def traces(dashboard: Dashboard) -> tuple[str, str]:
    """Two recorded ramps of different size, named small and large."""
    return _recorded(dashboard, "small", 0.05), _recorded(dashboard, "large", 0.12)


def _recorded(dashboard: Dashboard, name: str, amplitude: float) -> str:
    spec: dict[str, Any] = {"trajectory": RAMP | {"amplitude": amplitude}, "settle": 0.1, "hold": 0.8, "name": name}
    sent = dashboard.service.robot.post("/experiments", json={"spec": spec})
    ended = dashboard.service.end_of(sent.json()["id"])
    assert ended["state"] == "done", ended
    number: str = ended["trace"]
    return number


def _chart(page: Page, name: str = "Position and set point") -> Locator:
    return page.get_by_role("img", name=re.compile(f"^{name} of joint"))


def _box(page: Page, name: str) -> Locator:
    return page.get_by_role("checkbox", name=re.compile(f"Show {name} of")).first


def test_traces_are_found_and_laid_over_each_other(dashboard: Dashboard, traces: tuple[str, str]) -> None:
    page = dashboard.open("traces")
    page.get_by_role("searchbox").fill("large")
    expect(_box(page, "small")).not_to_be_attached()
    page.get_by_role("link", name="large").first.click()
    expect(_chart(page)).to_have_accessible_name(re.compile("of joint 1, 2, 3,"))
    page.get_by_role("searchbox").fill("")
    _box(page, "small").check()
    expect(page.get_by_role("list", name="Traces shown").get_by_role("listitem")).to_have_count(2)
    expect(_chart(page)).to_have_accessible_name(re.compile("of joint 1,"))
    page.get_by_role("group", name="Joint").get_by_role("button", name="J2").click()
    expect(_chart(page)).to_have_accessible_name(re.compile("of joint 2,"))
    assert re.search(f"{traces[1]}(,|%2C){traces[0]}", page.url)
    page.reload()
    expect(page.get_by_role("list", name="Traces shown").get_by_role("listitem")).to_have_count(2)


def test_the_chart_is_zoomed_by_buttons_and_by_dragging(dashboard: Dashboard, traces: tuple[str, str]) -> None:
    page = dashboard.open(f"traces/{traces[0]}")
    expect(_chart(page)).to_have_accessible_name(re.compile(r"0\.00 to 1\.\d\d s"))
    page.get_by_role("button", name="Zoom in").click()
    expect(_chart(page)).to_have_accessible_name(re.compile(r"0\.[23]\d to 0\.[89]\d s"))
    page.get_by_role("button", name="All", exact=True).click()
    expect(_chart(page)).to_have_accessible_name(re.compile(r"0\.00 to 1\.\d\d s"))
    area = _chart(page).locator(".u-over").bounding_box()
    assert area is not None
    page.mouse.move(area["x"] + 0.5 * area["width"], area["y"] + 50)
    page.mouse.down()
    page.mouse.move(area["x"] + 0.75 * area["width"], area["y"] + 60, steps=4)
    page.mouse.up()
    expect(_chart(page)).to_have_accessible_name(re.compile(r"0\.[56]\d to 0\.[89]\d s"))


def test_cursors_measure_what_the_service_says_of_the_whole_trace(
    dashboard: Dashboard, traces: tuple[str, str]
) -> None:
    page = dashboard.open(f"traces/{traces[1]}")
    expect(_chart(page)).to_be_visible()
    page.get_by_role("button", name="Measure").click()
    figures = {one["joint"]: one for one in dashboard.service.robot.get(f"/traces/{traces[1]}").json()["figures"]}
    page.get_by_role("textbox", name="A", exact=True).fill("0")
    page.get_by_role("textbox", name="A", exact=True).press("Enter")
    page.get_by_role("textbox", name="B", exact=True).fill("99")
    page.get_by_role("textbox", name="B", exact=True).press("Enter")
    panel = page.get_by_role("region", name="Between the cursors")
    for joint in (1, 2, 3):
        row = panel.get_by_role("row").filter(has=page.get_by_role("rowheader", name=f"J{joint}"))
        expect(row).to_contain_text(f"{figures[joint]['rise_time']:.2f} s")
        expect(row).to_contain_text(f"{figures[joint]['overshoot']:.2f}°")
    area = _chart(page).locator(".u-over").bounding_box()
    assert area is not None
    page.mouse.click(area["x"] + 0.25 * area["width"], area["y"] + 40)
    expect(page.get_by_role("textbox", name="A", exact=True)).to_have_value(re.compile(r"0\.[23]\d\d"))


@pytest.mark.timeout(600)
def test_a_simulation_is_laid_over_in_place(dashboard: Dashboard, traces: tuple[str, str]) -> None:
    page = dashboard.open(f"traces/{traces[0]}")
    page.get_by_role("button", name="Simulate").click()
    told = page.get_by_text(re.compile("simulated with the machine file, rms"))
    expect(told).to_be_visible(timeout=300_000)  # the first job of a worker may compile the simulation
    expect(told).to_contain_text(re.compile(r"J1 0\.\d\d°"))
    page.get_by_role("button", name="Without simulation").click()
    expect(told).not_to_be_attached()
    assert dashboard.service.robot.get("/jobs").json()["items"] == []


def test_tags_and_notes_are_kept_and_searched(dashboard: Dashboard, traces: tuple[str, str]) -> None:
    page = dashboard.open(f"traces/{traces[0]}")
    tags = page.get_by_role("textbox", name="Tags")
    tags.fill("good, bad/tag")
    expect(page.get_by_text("“bad/tag”: letters, digits")).to_be_visible()
    tags.fill("good, wear-study")
    page.get_by_role("textbox", name="Notes").fill("the belt was new")
    page.get_by_role("button", name="Keep tags and notes").click()
    expect(page.get_by_role("button", name="Kept")).to_be_visible()
    entry = dashboard.service.robot.get(f"/traces/{traces[0]}").json()["entry"]
    assert (entry["tags"], entry["notes"]) == (["good", "wear-study"], "the belt was new")
    page.get_by_role("button", name="wear-study").click()
    expect(page.get_by_role("list", name="Traces found").get_by_role("listitem")).to_have_count(1)
    page.get_by_role("button", name="Any tag").click()
    page.get_by_role("searchbox").fill("belt was")
    expect(page.get_by_role("list", name="Traces found").get_by_role("listitem")).to_have_count(1)


def test_a_trace_is_downloaded_in_both_forms_and_deleted(dashboard: Dashboard, traces: tuple[str, str]) -> None:
    page = dashboard.open(f"traces/{traces[1]}")
    with page.expect_download() as mcap:
        page.get_by_role("button", name="MCAP").click()
    raw = dashboard.service.robot.get(f"/traces/{traces[1]}/data.mcap").content
    assert Path(mcap.value.path()).read_bytes() == raw
    with page.expect_download() as table:
        page.get_by_role("button", name="CSV").click()
    assert Path(table.value.path()).read_text("utf-8").startswith("time,")
    page.get_by_role("button", name="Delete…").click()
    page.get_by_role("button", name="Delete for good").click()
    expect(page.get_by_text("Choose a trace")).to_be_visible()
    assert dashboard.service.robot.get(f"/traces/{traces[1]}").status_code == 404


def test_a_table_from_elsewhere_is_taken_in_and_shown(dashboard: Dashboard, tmp_path: Path) -> None:
    table = tmp_path / "rig.csv"
    rows = [f"{row / 50},{0.5 if row > 10 else 0},{0.5 * (1 - 0.9 ** max(0, row - 10))}" for row in range(100)]
    table.write_text("time,set_point_1,position_1\n" + "\n".join(rows), "utf-8")
    page = dashboard.open("traces")
    with page.expect_file_chooser() as chooser:
        page.get_by_role("button", name="Take in a file").click()
    chooser.value.set_files(table)
    expect(_chart(page)).to_have_accessible_name(re.compile(r"of joint 1, 0\.00 to 1\.98 s"))
    expect(page.get_by_text("imported").first).to_be_visible()


def test_a_trace_that_is_not_there_is_told(dashboard: Dashboard) -> None:
    page = dashboard.open("traces/000000000000")
    expect(page.get_by_text("there is no trace '000000000000'")).to_be_visible()
    dashboard.forgive()


def test_it_fits_a_tablet(dashboard: Dashboard, traces: tuple[str, str]) -> None:
    page = dashboard.open(f"traces/{traces[0]}")
    page.set_viewport_size(TABLET)
    expect(_chart(page)).to_be_visible()
    assert page.evaluate("document.documentElement.scrollWidth <= innerWidth")
