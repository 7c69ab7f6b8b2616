"""On the narrowest screens: Stop is whole on every page, nothing sticks out, and a thumb reaches every page."""

import json
import re
from typing import Any

import pytest
from playwright.sync_api import WebSocketRoute, expect

from tests.server.dashboard.browser import LIVE, Dashboard
from tests.server.dashboard.test_stop import PAGES

pytestmark = pytest.mark.browser
WIDTHS = (320, 360, 390, 768, 1280)
CONNECTIONS = {"lost": "link lost", "connecting": "robot connects", "disconnected": "robot not connected"}
STOP = """() => {
    const stop = document.querySelector('header button[aria-keyshortcuts]');
    const box = stop.getBoundingClientRect();
    const inset = 4;
    const corners = [[box.left + inset, box.top + inset], [box.right - inset, box.top + inset],
                     [box.left + inset, box.bottom - inset], [box.right - inset, box.bottom - inset]];
    return {
        width: box.width, left: box.left, right: box.right, top: box.top, inside: document.documentElement.clientWidth,
        covered: corners.some(([x, y]) => !stop.contains(document.elementFromPoint(x, y))),
        beyond: document.documentElement.scrollWidth - document.documentElement.clientWidth,
        hidden: [...document.querySelectorAll('nav[aria-label=Pages] a')].filter((link) => {
            const place = link.getBoundingClientRect();
            const at = document.elementFromPoint(place.left + place.width / 2, place.top + place.height / 2);
            return !link.contains(at) || place.left < 0 || place.right > innerWidth || place.bottom > innerHeight
                || link.scrollWidth > link.clientWidth;
        }).map((link) => link.textContent),
    };
}"""


class Line:
    """The page's connection to the service: what comes over it is changed on its way."""

    def __init__(self, dashboard: Dashboard) -> None:
        self._route: WebSocketRoute | None = None
        self._head: dict[str, float] = {}
        self._robot: dict[str, Any] = {}
        self.silent: set[str] = set()
        dashboard.page.route_web_socket(re.compile("/live"), self._join)

    def _join(self, route: WebSocketRoute) -> None:
        self._route = route
        server = route.connect_to_server()

        def hear(text: str | bytes) -> None:
            frame = json.loads(text)
            self._head = {"now": frame["now"], "utc": frame["utc"]}
            for message in frame["messages"]:
                if message["topic"] == "robot":
                    self._robot = message
            frame["messages"] = [one for one in frame["messages"] if one["topic"] not in self.silent]
            route.send(json.dumps(frame))

        server.on_message(hear)

    def say(self, *messages: dict[str, Any]) -> None:
        """As if the service had said it just now."""
        assert self._route is not None
        self._route.send(json.dumps({**self._head, "messages": messages}))

    def robot(self, connection: str) -> None:
        """The robot's connection, as the page is told from now on."""
        self.silent.add("robot")
        self.say({**self._robot, "connection": connection})


def _faults(dashboard: Dashboard, where: str, places: dict[int, set[tuple[float, float]]] | None = None) -> list[str]:
    """What is wrong with Stop and the links at every width. `places`: where Stop was at each, to which it is added."""
    page, found = dashboard.page, []
    places = {} if places is None else places
    for width in WIDTHS:
        page.set_viewport_size({"width": width, "height": 700})
        seen = page.evaluate(STOP)
        places.setdefault(width, set()).add((seen["left"], seen["top"]))
        if seen["left"] < 0 or seen["right"] > seen["inside"] or seen["top"] < 0 or seen["covered"]:
            found.append(f"{where} at {width} px: Stop is cut off or covered: {seen}")
        if seen["width"] < 96:
            found.append(f"{where} at {width} px: Stop is {seen['width']} px wide")
        if seen["beyond"] > 0:
            found.append(f"{where} at {width} px: {seen['beyond']} px stick out")
        if seen["hidden"]:
            found.append(f"{where} at {width} px: cannot be tapped: {seen['hidden']}")
    return found


def test_stop_is_whole_on_every_page_at_every_width(dashboard: Dashboard) -> None:
    line = Line(dashboard)
    page = dashboard.until_live()
    expect(page.get_by_title("A mock controller: nothing real moves")).to_be_visible()
    line.robot("disconnected")
    expect(page.get_by_role("banner").get_by_text("robot not connected")).to_be_visible()
    # Fingers get larger buttons, of which Stop must not become a smaller one.
    page.context.new_cdp_session(page).send("Emulation.setTouchEmulationEnabled", {"enabled": True})
    assert page.evaluate("matchMedia('(pointer: coarse)').matches")
    places: dict[int, set[tuple[float, float]]] = {}
    found = _faults(dashboard, "live", places)
    for path in PAGES[1:]:
        dashboard.open(path)
        found += _faults(dashboard, path, None if path == "kiosk" else places)
    dashboard.open("experiments").get_by_label("Name").focus()
    found += _faults(dashboard, "typing", places)
    assert found == []
    assert {width: len(one) for width, one in places.items()} == dict.fromkeys(WIDTHS, 1)  # a hand finds it unseen


def test_stop_is_whole_beside_every_badge(dashboard: Dashboard) -> None:
    line = Line(dashboard)
    page = dashboard.open("system")  # without charts, which would be drawn anew at every width
    banner = page.get_by_role("banner")
    expect(banner.get_by_text(LIVE).or_(dashboard.degraded)).to_be_visible()
    line.say({"topic": "thinned", "left_out": 7})
    expect(banner.get_by_text(re.compile("thinned|degraded"))).to_be_visible()
    found = _faults(dashboard, "thinned")
    line.silent.add("sample")
    expect(banner.get_by_text("stale")).to_be_visible()
    found += _faults(dashboard, "stale")
    for connection, text in CONNECTIONS.items():
        line.robot(connection)
        expect(banner.get_by_text(text)).to_be_visible()
        found += _faults(dashboard, text)
    page.keyboard.press("F8")
    expect(page.locator("[role=alert] [data-stop]")).to_be_visible()
    found += _faults(dashboard, "stopped")
    assert found == []


def test_a_phone_has_state_arm_numbers_and_jogging_before_the_charts(dashboard: Dashboard) -> None:
    page = dashboard.until_live()
    page.set_viewport_size({"width": 390, "height": 844})
    parts = [".now", *(f"[data-kind={kind}]" for kind in ("arm", "table", "hand", "charts", "link")), ".menu"]
    top = "one => one.getBoundingClientRect().top"
    places = [page.locator(f"main .page {part}").first.evaluate(top) for part in parts]
    assert places == sorted(places)
