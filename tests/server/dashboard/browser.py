"""A real Chromium on a real service, whose robot is a mock in real time that tests can ask behind its back."""

import json
import re
import shutil
import socket
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any
from urllib.parse import urlsplit

import pytest
from playwright.sync_api import (
    Browser,
    BrowserContext,
    ConsoleMessage,
    Locator,
    Page,
    Playwright,
    Request,
    ViewportSize,
    expect,
    sync_playwright,
)

from daq.transport.mock_process import MockProcess
from tests.server.service import Service

NAMES = ("chromium", "chromium-browser")
UNWANTED = (
    "SpareRendererForSitePerProcess",  # a process that would be left when a test has ended
    # What a browser does for people, beside showing a page:
    "DialMediaRouteProvider",
    "GlobalMediaControls",
    "MediaRouter",
    "OnDeviceModelPerformanceParams",
    "OptimizationGuideModelDownloading",
    "OptimizationGuideModelExecution",
    "OptimizationGuideOnDeviceModel",
    "OptimizationHints",
    "PaintHolding",
    "Translate",
)
OPTIONS = [f"--disable-features={','.join(UNWANTED)}", "--disable-component-update", "--disable-background-networking"]
WITHOUT_3D = ["--disable-3d-apis"]
"""Most tests do not look at the arm, and without a graphics card 3-D takes most of the processor."""
WITH_3D = ["--use-angle=swiftshader", "--enable-unsafe-swiftshader"]
NO_3D_HERE = ("WebGL", "THREE.WebGLRenderer")
"""What the console says where there is none."""
PATIENCE_MS = 60_000
"""For whatever is waited for: a machine may be busy. Nothing is tested by how long it takes."""
LIVE = re.compile(r"live \d+ Hz")
"""What the header says of data that comes; a busy machine gets less than every sample."""
TABLET: ViewportSize = {"width": 820, "height": 1180}
TABLET_ON_ITS_SIDE: ViewportSize = {"width": 1024, "height": 768}
WIDE: ViewportSize = {"width": 1280, "height": 800}


def find_chromium() -> str:
    """Where the system's Chromium is. Skips the test where there is none."""
    for name in NAMES:
        if (found := shutil.which(name)) is not None:
            return found
    pytest.skip("needs Chromium: apt install chromium (.ci/run does)")


@contextmanager
def playwright() -> Iterator[Playwright]:
    """What drives browsers; one for all of them."""
    find_chromium()
    expect.set_options(timeout=PATIENCE_MS)
    with sync_playwright() as found:
        yield found


@contextmanager
def chromium(driver: Playwright, *options: str) -> Iterator[Browser]:
    """The system's Chromium, without a window."""
    browser = driver.chromium.launch(executable_path=find_chromium(), args=[*OPTIONS, *options])
    try:
        yield browser
    finally:
        browser.close()


class MockControl:
    """The control port of the mock: what the board itself says, and the plug of its cable."""

    def __init__(self, mock: MockProcess) -> None:
        assert mock.control is not None
        parts = urlsplit(mock.control)
        assert parts.hostname is not None
        assert parts.port is not None
        self._connection = socket.create_connection((parts.hostname, parts.port), timeout=30)
        self._lines = self._connection.makefile("rb")

    def ask(self, do: str, **more: object) -> dict[str, Any]:
        """One command; its answer."""
        self._connection.sendall(json.dumps({"do": do, **more}).encode() + b"\n")
        answer: dict[str, Any] = json.loads(self._lines.readline())
        assert answer["ok"], answer
        return answer

    def close(self) -> None:
        """Hangs up."""
        self._lines.close()
        self._connection.close()


@dataclass
class Dashboard:
    """One tab of a browser on the service's page."""

    service: Service
    mock: MockControl | None
    """None where no test asks the mock behind the service's back."""
    page: Page
    complaints: list[str] = field(default_factory=list)
    """What the browser complained about: errors on its console, requests to elsewhere. A test fails that leaves any."""

    def open(self, path: str = "live") -> Page:
        """The page `path` once it is there."""
        self.page.goto(f"{self.service.url}/#/{path}")
        expect(self.page.get_by_role("heading", level=1).first).to_be_attached()
        return self.page

    def until_live(self) -> Page:
        """The Live page, once samples arrive."""
        self.open("live")
        expect(self.page.get_by_role("banner").get_by_text(LIVE).or_(self.degraded)).to_be_visible()
        return self.page

    @property
    def degraded(self) -> Any:
        """What stands in the place of LIVE while a busy machine lets requests be repeated."""
        return self.page.get_by_role("banner").get_by_text("link degraded")

    def forgive(self) -> None:
        """A lost connection is an error on the console, and is what this test is about."""
        self.complaints.clear()


def watched(context: BrowserContext, service: Service, mock: MockControl | None = None) -> Dashboard:
    """A new tab, with everything noted that the browser complains about."""
    context.add_init_script("localStorage.setItem('ma2000-tour', 'seen')")  # the tour has a test of its own
    page = context.new_page()
    page.set_default_timeout(PATIENCE_MS)
    tab = Dashboard(service, mock, page)
    here = urlsplit(service.url).hostname

    def said(message: ConsoleMessage) -> None:
        if message.type in ("error", "warning") and not any(word in message.text for word in NO_3D_HERE):
            tab.complaints.append(f"{message.type}: {message.text}")

    def requested(request: Request) -> None:
        parts = urlsplit(request.url)
        if parts.scheme not in ("data", "blob") and parts.hostname != here:
            tab.complaints.append(f"a request to elsewhere: {request.url}")

    page.on("console", said)
    page.on("pageerror", lambda error: tab.complaints.append(f"exception: {error}"))
    page.on("request", requested)
    return tab


def row_of(page: Page, trace: str) -> Locator:
    """The line of a trace where traces are chosen: it is called by its name and time there, and leads to it."""
    return page.get_by_role("row").filter(has=page.locator(f'a[href$="/traces/{trace}"]'))
