"""The Live page shows what the service says, and moves the arm for whoever has the control."""

import re

import pytest
from playwright.sync_api import Page, WebSocketRoute, expect

from tests.server.dashboard.browser import Dashboard

pytestmark = [pytest.mark.browser, pytest.mark.slow]
HOME_DEGREES = 180.0


def _cell(page: Page, joint: int, column: int) -> str:
    row = page.get_by_role("row").filter(has=page.get_by_role("rowheader", name=f"J{joint}"))
    return row.get_by_role("cell").nth(column).inner_text()


def _number(text: str) -> float:
    return float(text.replace("−", "-"))


def test_numbers_are_those_of_the_robot_with_unit_and_age_and_a_joint_that_is_hidden_stays_so(
    dashboard: Dashboard,
) -> None:
    page = dashboard.until_live()
    expect(page.get_by_text(re.compile(r"^\d+ ms old · tick \d+"))).to_be_visible()
    measured = dashboard.service.status()["sample"]["position"][1]
    assert abs(_number(_cell(page, 2, 1)) - measured * 57.29578) < 0.5
    expect(page.get_by_role("columnheader", name="Position °")).to_be_visible()
    page.get_by_role("button", name="rad", exact=True).click()
    expect(page.get_by_role("columnheader", name="Position rad")).to_be_visible()
    assert abs(_number(_cell(page, 2, 1)) - measured) < 0.01
    page.get_by_role("button", name="degrees").click()
    page.get_by_role("button", name="J6, roll").click()
    page.reload()
    expect(page.get_by_role("button", name="J6, roll")).to_have_attribute("aria-pressed", "false")
    expect(page.get_by_role("img", name="joints 1, 2, 3, 4, 5 over").first).to_be_visible()


def test_an_experiment_is_seen_to_run_and_its_motion_in_the_numbers(dashboard: Dashboard) -> None:
    page = dashboard.until_live()
    top = "document.querySelector('.place[data-kind=charts]').offsetTop"
    place = page.evaluate(top)
    before = _number(_cell(page, 1, 0))
    amplitude = -0.1 if before > HOME_DEGREES else 0.1  # earlier tests may have left the arm where a ramp would end
    ramp = {"kind": "ramp", "amplitude": amplitude, "duration": 0.5}
    sent = dashboard.service.robot.post("/experiments", json={"spec": {"trajectory": ramp, "joints": [1]}})
    assert sent.status_code == 201, sent.text
    expect(page.get_by_text("An experiment is running.")).to_be_visible()
    expect(page.get_by_role("banner").get_by_text("moving")).to_be_visible()
    ended = dashboard.service.end_of(sent.json()["id"])
    assert ended["state"] == "done", ended
    expect(page.get_by_text("Nothing is running or waiting.")).to_be_visible()
    expect(page.get_by_role("banner").get_by_text("moving")).not_to_be_attached()
    assert abs(_number(_cell(page, 1, 0)) - before) > 2
    result = page.get_by_role("button", name="Last result")
    expect(result).to_be_visible()
    assert page.evaluate(top) == place  # the end of a run moves nothing from under a hand
    result.click()
    expect(page.get_by_role("region", name="Result of ramp")).to_be_visible()


def test_a_run_that_failed_is_told_until_it_was_read(dashboard: Dashboard) -> None:
    ramp = {"kind": "ramp", "amplitude": 0.01, "duration": 0.1}
    sent = dashboard.service.robot.post("/experiments", json={"spec": {"trajectory": ramp, "joints": [4]}}).json()
    ended = dashboard.service.end_of(sent["id"]) | {"state": "failed", "reason": "joint 2 is far behind"}
    dashboard.page.route("**/experiments?order=ended&limit=10", lambda route: route.fulfill(json={"items": [ended]}))
    page = dashboard.until_live()
    said = page.get_by_text("failed: joint 2 is far behind")
    page.get_by_text("The last run failed").click()
    expect(said).to_be_visible()
    dashboard.open("kiosk")
    expect(said).to_be_visible()
    page.set_viewport_size({"width": 740, "height": 360})
    told, stop = (one.bounding_box() for one in (page.locator(".state"), page.get_by_role("button", name="STOP")))
    assert told is not None
    assert stop is not None
    assert told["x"] + told["width"] <= stop["x"]
    page.get_by_role("button", name="Dismiss").click()
    expect(said).not_to_be_attached()
    dashboard.until_live()
    expect(said).not_to_be_attached()


def test_charts_are_drawn_with_the_past_when_the_page_is_loaded(dashboard: Dashboard) -> None:
    page = dashboard.until_live()
    for name in ("Events", "J2 position and set point", "Error", "Drive"):
        chart = page.get_by_role("img", name=name)
        expect(chart.locator("canvas")).to_be_visible()
    coloured = (
        page.get_by_role("img", name="J2 position and set point")
        .locator("canvas")
        .evaluate(
            """canvas => {
            const { data } = canvas.getContext('2d').getImageData(0, 0, canvas.width, canvas.height);
            let found = 0;
            for (let at = 0; at < data.length; at += 4)
                if (data[at + 3] > 200 && Math.abs(data[at] - data[at + 2]) > 60) found += 1;
            return found;
        }"""
        )
    )
    assert coloured > 60  # one line of one joint


def test_a_joint_moves_while_its_key_is_held_and_the_gripper_closes_for_whoever_has_the_control(
    dashboard: Dashboard,
) -> None:
    page = dashboard.until_live()
    page.get_by_role("button", name="Take control").click()
    before = dashboard.mock.ask("state")["set_points"][0]
    button = page.get_by_role("button", name="Joint 1 backward while held")
    button.hover()
    page.mouse.down()
    expect(page.get_by_text("It moves while somebody jogs it.")).to_be_visible()
    while abs(dashboard.mock.ask("state")["set_points"][0] - before) < 5:
        page.wait_for_timeout(20)  # lets the page repeat its command; the test's own time limit ends the wait
    page.mouse.up()
    page.get_by_role("button", name="Keep this posture").click()
    expect(page.get_by_text("Move to J1")).to_be_visible()
    page.get_by_role("button", name="Close", exact=True).click()
    expect(page.get_by_text("Gripper: closed")).to_be_visible()
    assert dashboard.service.robot.get("/process").json()["gripper"] == "closed"
    page.get_by_role("button", name="Output 3").click()
    expect(page.get_by_role("button", name="Output 3")).to_have_attribute("aria-pressed", "true")
    assert dashboard.service.robot.get("/process").json()["outputs"][3]
    page.get_by_role("button", name="Open", exact=True).click()
    page.get_by_role("button", name="Output 3").click()
    expect(page.get_by_role("button", name="Output 3")).to_have_attribute("aria-pressed", "false")
    page.get_by_role("button", name="Release control").click()
    expect(page.get_by_role("button", name="Take control")).to_be_visible()
    assert dashboard.service.robot.get("/control").json()["holder"] == "nobody"


def test_a_joint_is_not_driven_on_when_the_connection_was_lost_while_its_key_was_held(dashboard: Dashboard) -> None:
    connections: list[WebSocketRoute] = []
    sent: list[str] = []
    heard: list[str | bytes] = []

    def join(route: WebSocketRoute) -> None:
        server = route.connect_to_server()
        connections.append(server)
        sent.clear()
        heard.clear()

        def send(message: str | bytes) -> None:
            sent.append(str(message))
            server.send(message)

        def hear(message: str | bytes) -> None:
            heard.append(message)
            route.send(message)

        route.on_message(send)
        server.on_message(hear)

    page = dashboard.page
    page.route_web_socket(re.compile("/live"), join)
    dashboard.until_live()
    page.get_by_role("button", name="Take control").click()
    page.get_by_role("group", name="Jog:").focus()
    page.keyboard.down("ArrowLeft")
    expect(page.get_by_text("It moves while somebody jogs it.")).to_be_visible()
    before = len(connections)
    connections[-1].close()
    while len(connections) == before or len(heard) < 50:
        page.wait_for_timeout(20)  # lets the page connect again; the test's own time limit ends the wait
    assert [text for text in sent if "jog" in text] == []
    page.keyboard.up("ArrowLeft")
    page.get_by_role("button", name="Release control").click()
    expect(page.get_by_role("button", name="Take control")).to_be_visible()
    dashboard.forgive()


def test_the_system_page_tells_health_storage_and_what_happened(dashboard: Dashboard) -> None:
    page = dashboard.open("system")
    expect(page.get_by_role("heading", name="Health")).to_be_visible()
    health = page.get_by_role("region", name="Health")
    expect(health.get_by_text(re.compile("^(ready|look below)$"))).to_be_visible()
    page.keyboard.press("F8")
    expect(health.get_by_text("stopped", exact=True)).to_be_visible()
    expect(health.get_by_text("look below", exact=True)).to_be_visible()  # as its worst row
    expect(page.get_by_text(dashboard.service.client.get("/system").json()["storage"]["traces_folder"])).to_be_visible()
    expect(page.get_by_role("cell", name="connection").first).to_be_visible()
