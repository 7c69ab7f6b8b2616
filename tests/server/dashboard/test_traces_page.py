"""The page of traces: found, laid over each other, zoomed, measured, simulated, noted, taken in and out."""

import re
import uuid
from datetime import UTC, datetime
from pathlib import Path

import numpy as np
import pytest
from playwright.sync_api import Locator, Page, expect

from daq.contracts.experiment import ExperimentSpec
from daq.contracts.machine import load_machine
from daq.contracts.trace import Floats, Trace, TraceRecord
from daq.traces.store import write_trace
from tests.server.dashboard.browser import TABLET, WIDE, Dashboard, MockControl
from tests.server.dashboard.faults import faults_in_both_schemes, faults_of
from tests.server.service import Service

pytestmark = [pytest.mark.browser, pytest.mark.slow]
JOINTS = (1, 2, 3)
PERIOD = 0.02
Served = tuple[Service, MockControl]


def _taken_in(service: Service, folder: Path, name: str, amplitude: float) -> str:
    """A step of joints 1 to 3 that swings about its target, as a trace of the service; its number."""
    time: Floats = np.arange(80, dtype=np.float64) * PERIOD
    since = np.maximum(0, time - 0.3)[:, None]
    begin = np.array([3.1, 0.8, 0.0])
    way = amplitude * np.array([1.0, -0.5, 0.8])
    set_point = begin + way * (since > 0)
    position: Floats = begin + way * (1 - np.exp(-6 * since) * (np.cos(9 * since) + 6 / 9 * np.sin(9 * since)))
    record = TraceRecord(
        trace_id=uuid.uuid4().hex[:12],
        created=datetime.now(UTC),
        software="tests",
        source="mock",
        machine=load_machine("ma2000"),
        spec=ExperimentSpec(name=name),
        gains=dict.fromkeys(range(1, 7), (2, 0, 0)),
        period=PERIOD,
        drive_unit="V",
        outcome="complete",
    )
    error = set_point - position
    trace = Trace(record, JOINTS, time, position, set_point, error, 20 * error, tick=np.arange(len(time)))
    path = write_trace(trace, folder / f"{name}.mcap")
    sent = service.robot.post(
        "/traces", content=path.read_bytes(), headers={"Content-Type": "application/octet-stream"}
    )
    assert sent.status_code == 201, sent.text
    return record.trace_id


@pytest.fixture(scope="module")
def traces(served: Served, tmp_path_factory: pytest.TempPathFactory) -> tuple[str, str]:
    """Two traces of different size, named small and large."""
    service, _ = served
    folder = tmp_path_factory.mktemp("traces")
    return _taken_in(service, folder, "small", 0.05), _taken_in(service, folder, "large", 0.12)


@pytest.fixture(scope="module")
def worker(served: Served, traces: tuple[str, str]) -> None:
    """A first job, so that there is a worker process before a test looks at what is left running."""
    service, _ = served
    request = {"kind": "compare", "traces": [traces[0]], "models": ["machine"]}
    job = service.robot.post("/jobs", json=request).json()["id"]
    while (state := service.robot.get(f"/jobs/{job}", params={"wait": 30}).json()["state"]) in ("queued", "running"):
        pass
    assert state == "done"
    service.robot.delete(f"/jobs/{job}")


def _chart(page: Page, name: str = "Position and set point") -> Locator:
    return page.get_by_role("img", name=re.compile(f"^{name} of joint"))


def _box(page: Page, name: str) -> Locator:
    return page.get_by_role("checkbox", name=re.compile(f"Show {name} of")).first


def test_traces_are_found_and_laid_over_each_other(dashboard: Dashboard, traces: tuple[str, str]) -> None:
    page = dashboard.open("traces")
    page.get_by_role("combobox", name="Search words").fill("large")
    expect(_box(page, "small")).not_to_be_attached()
    page.get_by_role("link", name="large").first.click()
    expect(_chart(page)).to_have_accessible_name(re.compile("of joint 1, 2, 3,"))
    page.get_by_role("combobox", name="Search words").fill("")
    _box(page, "small").check()
    expect(page.get_by_role("list", name="Traces shown").get_by_role("listitem")).to_have_count(2)
    expect(_chart(page)).to_have_accessible_name(re.compile("of joint 1,"))
    page.get_by_role("group", name="Joint").get_by_role("button", name="J2").click()
    expect(_chart(page)).to_have_accessible_name(re.compile("of joint 2,"))
    assert re.search(f"{traces[1]}(,|%2C){traces[0]}", page.url)
    page.reload()
    expect(page.get_by_role("list", name="Traces shown").get_by_role("listitem")).to_have_count(2)
    for name in ("Best shift", "Difference", "Spectrum"):
        page.get_by_role("button", name=name).click()
    expect(page.get_by_role("img", name="Difference of the positions of joint 1")).to_be_visible()
    expect(page.get_by_role("img", name="Amplitude spectrum of the error of joint 1")).to_be_in_viewport()
    expect(page.get_by_text(re.compile(r"^rms of the difference: trace 2 small: \d+\.\d+°"))).to_be_visible()
    assert faults_of(page) == []


def test_the_chart_is_zoomed_by_buttons_and_by_dragging(dashboard: Dashboard, traces: tuple[str, str]) -> None:
    page = dashboard.open(f"traces/{traces[0]}")
    expect(_chart(page)).to_have_accessible_name(re.compile(r"0\.00 to 1\.58 s"))
    page.get_by_role("button", name="Zoom in").click()
    expect(_chart(page)).to_have_accessible_name(re.compile(r"0\.(39|40) to 1\.1\d s"))
    page.get_by_role("button", name="All", exact=True).click()
    expect(_chart(page)).to_have_accessible_name(re.compile(r"0\.00 to 1\.58 s"))
    area = _chart(page).locator(".u-over").bounding_box()
    assert area is not None
    page.mouse.move(area["x"] + 0.5 * area["width"], area["y"] + 50)
    page.mouse.down()
    page.mouse.move(area["x"] + 0.75 * area["width"], area["y"] + 60, steps=4)
    page.mouse.up()
    expect(_chart(page)).to_have_accessible_name(re.compile(r"0\.[78]\d to 1\.[12]\d s"))


def test_cursors_measure_what_the_service_says_of_the_whole_trace(
    dashboard: Dashboard, traces: tuple[str, str]
) -> None:
    page = dashboard.open(f"traces/{traces[1]}")
    expect(_chart(page)).to_be_visible()
    page.get_by_role("button", name="Measure").click()
    figures = {one["joint"]: one for one in dashboard.service.robot.get(f"/traces/{traces[1]}").json()["figures"]}
    page.get_by_role("textbox", name="Cursor A").fill("0")
    page.get_by_role("textbox", name="Cursor A").press("Enter")
    page.get_by_role("textbox", name="Cursor B").fill("99")
    page.get_by_role("textbox", name="Cursor B").press("Enter")
    panel = page.get_by_role("region", name="Between the cursors")
    for joint in (1, 2, 3):
        row = panel.get_by_role("row").filter(has=page.get_by_role("rowheader", name=f"J{joint}"))
        expect(row).to_contain_text(f"{figures[joint]['rise_time']:.2f} s")
        expect(row).to_contain_text(f"{figures[joint]['overshoot']:.2f}°")
    area = _chart(page).locator(".u-over").bounding_box()
    assert area is not None
    page.mouse.click(area["x"] + 0.25 * area["width"], area["y"] + 40)
    expect(page.get_by_role("textbox", name="Cursor A")).to_have_value(re.compile(r"0\.[34]\d\d"))
    told = _chart(page).locator(".u-legend")
    expect(told).to_contain_text(re.compile(r"^at[^J]*0\.[34]\d* s.*J1 set point.*J1 position[^J]*\d\.\d\d", re.DOTALL))
    expect(page.locator(".u-cursor-y")).to_have_count(0)


@pytest.mark.timeout(600)
def test_a_simulation_is_laid_over_in_place(dashboard: Dashboard, traces: tuple[str, str], worker: None) -> None:
    page = dashboard.open(f"traces/{traces[0]}")
    page.get_by_role("button", name="Simulate").click()
    told = page.get_by_text(re.compile("simulated with the machine file, rms"))
    expect(told).to_be_visible()
    expect(told).to_contain_text(re.compile(r"J1 \d+\.\d\d°, J2 \d+\.\d\d°, J3 \d+\.\d\d°"))
    page.get_by_role("button", name="Remove simulation").click()
    expect(told).not_to_be_attached()
    assert dashboard.service.robot.get("/jobs").json()["items"] == []


def test_tags_and_notes_are_kept_and_searched(dashboard: Dashboard, traces: tuple[str, str]) -> None:
    page = dashboard.open(f"traces/{traces[0]}")
    tags = page.get_by_role("textbox", name="Tags")
    tags.fill("good, bad/tag")
    expect(page.get_by_text("“bad/tag”: letters, digits")).to_be_visible()
    tags.fill("good, wear-study")
    page.get_by_role("textbox", name="Notes").fill("the belt was new")
    expect(page.get_by_role("form").get_by_text("Saved", exact=True)).to_be_visible()
    entry = dashboard.service.robot.get(f"/traces/{traces[0]}").json()["entry"]
    assert (entry["tags"], entry["notes"]) == (["good", "wear-study"], "the belt was new")
    page.get_by_role("button", name="wear-study").click()
    expect(page.get_by_role("list", name="Traces found").get_by_role("listitem")).to_have_count(1)
    line = page.get_by_role("combobox", name="Search words")
    expect(line).to_have_value("tag:wear-study")
    line.fill("source:moon")
    expect(page.get_by_text("source: needs one of mock, real, imported")).to_be_visible()
    line.fill("belt was source:mock")
    expect(page.get_by_role("list", name="Traces found").get_by_role("listitem")).to_have_count(1)


def test_a_trace_is_downloaded_in_both_forms_and_deleted(dashboard: Dashboard, tmp_path: Path) -> None:
    number = _taken_in(dashboard.service, tmp_path, "not-for-long", 0.08)
    page = dashboard.open(f"traces/{number}")
    with page.expect_download() as mcap:
        page.get_by_role("button", name="MCAP").click()
    raw = dashboard.service.robot.get(f"/traces/{number}/data.mcap").content
    assert Path(mcap.value.path()).read_bytes() == raw
    with page.expect_download() as table:
        page.get_by_role("button", name="CSV").click()
    assert Path(table.value.path()).read_text("utf-8").startswith("time [s],")
    page.get_by_role("button", name="Delete…").click()
    page.get_by_role("button", name="Delete permanently").click()
    expect(page.get_by_text("Choose a trace")).to_be_visible()
    assert dashboard.service.robot.get(f"/traces/{number}").status_code == 404


def test_a_table_from_elsewhere_is_taken_in_and_shown(dashboard: Dashboard, tmp_path: Path) -> None:
    table = tmp_path / "rig.csv"
    rows = [f"{row / 50},{0.5 if row > 10 else 0},{0.5 * (1 - 0.9 ** max(0, row - 10))}" for row in range(100)]
    table.write_text("time,set_point_1,position_1\n" + "\n".join(rows) + "\n", "utf-8")
    page = dashboard.open("traces")
    with page.expect_file_chooser() as chooser:
        page.get_by_role("button", name="Import a file").click()
    chooser.value.set_files(table)
    expect(_chart(page)).to_have_accessible_name(re.compile(r"of joint 1, 0\.00 to 1\.98 s"))
    expect(page.get_by_role("definition").filter(has_text="imported").first).to_be_visible()


def test_a_trace_that_is_not_there_is_told(dashboard: Dashboard) -> None:
    page = dashboard.open("traces/000000000000")
    expect(page.get_by_text("there is no trace '000000000000'")).to_be_visible()
    dashboard.forgive()


def test_axe_finds_no_fault_with_traces_shown_and_they_fit_a_tablet(
    dashboard: Dashboard, traces: tuple[str, str]
) -> None:
    page = dashboard.open(f"traces/{traces[0]},{traces[1]}")
    page.set_viewport_size(TABLET)
    expect(_chart(page)).to_be_visible()
    assert page.evaluate("document.documentElement.scrollWidth <= innerWidth")
    page.set_viewport_size(WIDE)
    page.get_by_role("button", name="Measure").click()
    expect(page.get_by_role("region", name="Between the cursors").get_by_role("table")).to_be_visible()
    assert faults_in_both_schemes(page) == []
