"""The dashboard with six joints and 3-D on: script a frame, frames, sample to screen, server load, first load.

    python -m benchmarks dashboard [--seconds 20] [--program PATH] [--emulated-card]

A Chromium without a window, a service and a mock in real time share this machine's cores; where there is no graphics
card, everything is drawn by the processor, and the target for frames is that of software rendering: WebGL by
SwiftShader, the rest as Chromium does it then. `--emulated-card` makes it draw all of the page with SwiftShader as if
that were a card, which it does not do by itself and which is much slower.

A frame is one that the browser gives the page. Not everything is drawn anew in every one: charts when there is a new
sample, 3-D within what time it is allowed; both are counted for themselves, by the calls that begin a drawing. Sample
to screen is what the service says of a sample's age when it sends it, plus the way to the browser and until the frame
is drawn in which a chart has it: the browser's wall clock less the service's, which are one clock on one machine.
"""

from __future__ import annotations

import argparse
import os
import shutil
import sys
import tempfile
import time
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from playwright.sync_api import Browser, CDPSession, Page, sync_playwright

from benchmarks.figures import Figure, at_least, at_most, quantile, show
from benchmarks.mock_process import started_mock
from benchmarks.service_process import ROBOT, RunningService, started_service, sway

SCRIPT_TARGET_MS = 6.0
FRAMES_TARGET = 25.0
SERVER_TARGET = 3.0
LATENCY_TARGET_MS = 60.0
FIRST_TARGET_MS = 500.0
TRANSFER_TARGET_KB = 300.0
WARM_UP = 3.0
"""Time (s) after loading that is not measured: compilation, caches, loading of 3-D."""
LOADS = 5
PATIENCE = 60_000
OPTIONS = ["--enable-unsafe-swiftshader"]
"""Options of Chromium; newer versions draw 3-D in software only when it is allowed explicitly."""
EMULATED_CARD = ["--use-angle=swiftshader"]

WATCH = """
const watched = (window.watched = { latencies: [], frames: 0, charts: 0, scenes: 0, first: null });
let waiting = [];
let chartAt = -1;
const Native = window.WebSocket;
window.WebSocket = class extends Native {
  constructor(...given) {
    super(...given);
    this.addEventListener('message', (event) => {
      const { now, utc, messages } = JSON.parse(event.data);
      const sample = messages.findLast((message) => message.topic === 'sample');
      if (sample !== undefined) waiting.push(now - sample.host_time - utc);
    });
  }
};
const clear2d = CanvasRenderingContext2D.prototype.clearRect;
CanvasRenderingContext2D.prototype.clearRect = function (...given) {
  clear2d.apply(this, given);
  if (chartAt === watched.frames) return;
  chartAt = watched.frames;
  watched.charts += 1;
  const shown = waiting;
  waiting = [];
  // After the frame to which this drawing belongs.
  setTimeout(() => {
    const wall = (performance.timeOrigin + performance.now()) / 1000;
    for (const age of shown) watched.latencies.push(age + wall);
  }, 0);
};
const clear3d = WebGL2RenderingContext.prototype.clear;
WebGL2RenderingContext.prototype.clear = function (...given) {
  watched.scenes += 1;
  clear3d.apply(this, given);
};
const isShown = () =>
  chartAt > 0 && [...document.querySelectorAll('main td.number')].some((cell) => /^[−-]?\\d+\\./.test(cell.innerText));
(function count() {
  watched.frames += 1;
  if (watched.first === null && isShown()) setTimeout(() => (watched.first ??= performance.now()), 0);
  requestAnimationFrame(count);
})();
"""
"""Runs before the page's own script. The first live data is there when the table has numbers and a chart is drawn."""
RENDERER = """() => {
  const context = document.createElement('canvas').getContext('webgl2');
  const details = context?.getExtension('WEBGL_debug_renderer_info');
  return details ? context.getParameter(details.UNMASKED_RENDERER_WEBGL) : 'nothing';
}"""
COUNTS = ("frames", "charts", "scenes")


@dataclass(frozen=True)
class Seen:
    """What one tab showed of `seconds` s."""

    seconds: float
    script: float
    """Time (s) spent in JavaScript."""
    frames: int
    charts: int
    """Frames in which charts were drawn."""
    scenes: int
    """Drawings in 3-D."""
    moved: bool
    """Whether the arm moved until the end."""
    renderer: str
    """The renderer of 3-D as the browser names it."""
    latencies: list[float]
    firsts: list[float]
    """Times (ms) from the start of a load, with an empty browser cache, to the first sample on the screen."""
    transfer: int
    """Transferred size (bytes) of the first load."""
    used: float
    """Processor time (s) of the server."""


def main() -> int:
    """Measures and prints."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks dashboard")
    parser.add_argument("--seconds", type=float, default=20.0)
    parser.add_argument("--quick", action="store_true", help="5 s")
    parser.add_argument("--emulated-card", action="store_true", help="draw all of the page with SwiftShader")
    parser.add_argument("--program", default=shutil.which("chromium"), help="the browser")
    options = parser.parse_args()
    if options.program is None:
        print("no Chromium found: name one with --program", file=sys.stderr)
        return 2
    seconds = 5.0 if options.quick else options.seconds
    with (
        tempfile.TemporaryDirectory() as folder,
        started_mock("--pty", "--seed", "3") as mock,
        started_service(Path(folder), mock.url) as service,
    ):
        service.ask("POST", "/connect")
        idle = _used_during(service, seconds, None)
        _move(service, seconds)
        alone = _used_during(service, seconds, None)
        flags = OPTIONS + (EMULATED_CARD if options.emulated_card else [])
        seen = _watched(service, options.program, flags, seconds)
    print(f"server without an experiment and without a viewer: {100 * idle / seconds:.2f} % of a core")
    print(f"3-D is drawn by {seen.renderer}")
    return show("Dashboard", "python -m benchmarks dashboard", _figures(seen, alone))


def _figures(seen: Seen, alone: float) -> list[Figure]:
    frames = seen.frames / seen.seconds
    latencies = [1000 * latency for latency in seen.latencies]
    server = 100 * (seen.used - alone) / seen.seconds
    return [
        at_most("page script a frame", 1000 * seen.script / seen.frames, SCRIPT_TARGET_MS, "ms", "six joints, 3-D"),
        at_least("frames of the page", frames, FRAMES_TARGET, "1/s", "target: software rendering"),
        Figure("of these with charts drawn anew", f"{seen.charts / seen.seconds:.3g} 1/s"),
        Figure(
            "3-D drawn anew",
            f"{seen.scenes / seen.seconds:.3g} 1/s",
            beside="the arm moves" if seen.moved else "the arm stands still: the machine is too busy to move it",
        ),
        at_most(
            "sample to screen, p95", quantile(latencies, 0.95), LATENCY_TARGET_MS, "ms", f"{len(latencies)} samples"
        ),
        Figure("sample to screen, median", f"{quantile(latencies, 0.5):.3g} ms"),
        at_most(
            "server for one viewer",
            server,
            SERVER_TARGET,
            "% of a core",
            f"without: {100 * alone / seen.seconds:.2f} %",
        ),
        at_most(
            "first live data after load, median",
            quantile(seen.firsts, 0.5),
            FIRST_TARGET_MS,
            "ms",
            f"longest of {len(seen.firsts)}: {max(seen.firsts):.0f} ms",
        ),
        at_most("first load, compressed", seen.transfer / 1000, TRANSFER_TARGET_KB, "kB", "with 3-D"),
    ]


def _watched(service: RunningService, program: str, flags: list[str], seconds: float) -> Seen:
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=program, args=flags)
        _first_page(browser, service)
        firsts = [_first_data(browser, service) for _ in range(LOADS)]
        _move(service, seconds)
        page = _tab(browser)
        session = page.context.new_cdp_session(page)
        received = _received(session)
        session.send("Performance.enable")
        page.goto(f"{service.url}/#/live")
        _until_shown(page)
        page.wait_for_timeout(1000 * WARM_UP)
        before = _now(page, session)
        used = _used_during(service, seconds, page)
        after = _now(page, session)
        latencies = page.evaluate("window.watched.latencies")[before["latencies"] :]
        moved = _is_moving(service)
        renderer = str(page.evaluate(RENDERER))
        browser.close()
    return Seen(
        seconds=after["at"] - before["at"],
        script=after["script"] - before["script"],
        **{name: int(after[name] - before[name]) for name in COUNTS},
        moved=moved,
        renderer=renderer,
        latencies=latencies,
        firsts=firsts,
        transfer=sum(received),
        used=used,
    )


def _move(service: RunningService, seconds: float) -> None:
    """Lets the arm sway for the rest of the measurement. A busy machine may have ended it: the owner of the port does,
    when samples come too late."""
    if not _is_moving(service):
        with suppress(RuntimeError):  # where it is refused the arm stands still, and the figures say so
            service.reset()
            service.ask("POST", "/queue/resume", json={})
        service.submit(sway(4 * (seconds + WARM_UP) + 40))


def _is_moving(service: RunningService) -> bool:
    return bool(service.ask("GET", f"{service.url}/api/v1/robots/{ROBOT}")["activity"] == "experiment")


def _tab(browser: Browser) -> Page:
    """A tab of its own, with nothing in its cache."""
    page = browser.new_context(viewport={"width": 1280, "height": 800}).new_page()
    page.set_default_timeout(PATIENCE)
    page.add_init_script(WATCH)
    return page


def _first_page(browser: Browser, service: RunningService) -> None:
    """What a browser does once, when it is started, is not the page's: its picture is loaded before."""
    page = browser.new_page()
    page.goto(f"{service.url}/icon.svg")
    page.close()


def _first_data(browser: Browser, service: RunningService) -> float:
    page = _tab(browser)
    page.goto(f"{service.url}/#/live")
    _until_shown(page)
    first = float(page.evaluate("window.watched.first"))
    page.context.close()
    return first


def _until_shown(page: Page) -> None:
    while page.evaluate("window.watched.first") is None:
        page.wait_for_timeout(20)


def _received(session: CDPSession) -> list[int]:
    """Bytes of every answer, as they come; the live socket is no answer."""
    found: list[int] = []
    session.on("Network.loadingFinished", lambda event: found.append(int(event["encodedDataLength"])))
    session.send("Network.enable")
    return found


def _now(page: Page, session: CDPSession) -> dict[str, Any]:
    metrics = {one["name"]: one["value"] for one in session.send("Performance.getMetrics")["metrics"]}
    counts: dict[str, Any] = page.evaluate("({ ...window.watched, latencies: window.watched.latencies.length })")
    return {"at": metrics["Timestamp"], "script": metrics["ScriptDuration"], **counts}


def _used_during(service: RunningService, seconds: float, page: Page | None) -> float:
    """Processor time (s) that the server's process uses in so many seconds, its owner of the port not counted."""
    before = _used(service.process.pid)
    if page is None:
        time.sleep(seconds)
    else:
        page.wait_for_timeout(1000 * seconds)  # the browser's messages are dispatched meanwhile
    return _used(service.process.pid) - before


def _used(process: int) -> float:
    fields = Path(f"/proc/{process}/stat").read_text("utf-8").rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


if __name__ == "__main__":
    sys.exit(main())
