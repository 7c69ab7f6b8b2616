"""The dashboard with six joints and 3-D on: script a frame, frames, sample to screen, server load, first load.

    python -m benchmarks dashboard [--seconds 20] [--program PATH]

A Chromium without a window, a service and a mock in real time share this machine's cores; where there is no graphics
card, 3-D is drawn by the processor, and the target for frames is that of software rendering. Sample to screen is what
the service says of a sample's age when it sends it, plus the way to the browser and until the frame that shows it is
drawn: the browser's wall clock less the service's, which are one clock on one machine.
"""

from __future__ import annotations

import argparse
import os
import shutil
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from playwright.sync_api import CDPSession, Page, sync_playwright

from benchmarks.figures import Figure, at_least, at_most, quantile, show
from benchmarks.mock_process import started_mock
from benchmarks.service_process import RunningService, started_service, sway

SCRIPT_TARGET_MS = 6.0
FRAMES_TARGET = 25.0
SERVER_TARGET = 3.0
LATENCY_TARGET_MS = 60.0
FIRST_TARGET_MS = 500.0
TRANSFER_TARGET_KB = 300.0
WARM_UP = 3.0
"""s after the load that are not measured: compilers, caches, 3-D being loaded."""
PATIENCE = 60_000
OPTIONS = ["--use-angle=swiftshader", "--enable-unsafe-swiftshader"]

WATCH = """
window.watched = { latencies: [], frames: 0, first: null };
const Native = window.WebSocket;
window.WebSocket = class extends Native {
  constructor(...given) {
    super(...given);
    this.addEventListener('message', (event) => {
      const { now, utc, messages } = JSON.parse(event.data);
      const sample = messages.findLast((message) => message.topic === 'sample');
      if (sample === undefined) return;
      // After the frame in which the page draws what it has just heard.
      requestAnimationFrame(() => setTimeout(() => {
        const wall = (performance.timeOrigin + performance.now()) / 1000;
        window.watched.latencies.push(now - sample.host_time + wall - utc);
        window.watched.first ??= performance.now();
      }, 0));
    });
  }
};
(function count() { window.watched.frames += 1; requestAnimationFrame(count); })();
"""
"""Runs before the page's own script."""


@dataclass(frozen=True)
class Seen:
    """What one tab showed of `seconds` s."""

    seconds: float
    script: float
    """s of JavaScript."""
    frames: int
    latencies: list[float]
    first: float
    """ms from the start of the load to the first sample on the screen."""
    transfer: int
    """Bytes of the first load, as sent."""
    used: float
    """s of processor time of the server."""


def main() -> int:
    """Measures and prints."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks dashboard")
    parser.add_argument("--seconds", type=float, default=20.0)
    parser.add_argument("--quick", action="store_true", help="5 s")
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
        service.submit(sway(4 * (seconds + WARM_UP) + 40))
        alone = _used_during(service, seconds, None)
        seen = _watched(service, options.program, seconds)
    print(f"server without an experiment and without a viewer: {100 * idle / seconds:.2f} % of a core")
    return show("Dashboard", "python -m benchmarks dashboard", _figures(seen, alone))


def _figures(seen: Seen, alone: float) -> list[Figure]:
    frames = seen.frames / seen.seconds
    latencies = [1000 * latency for latency in seen.latencies]
    server = 100 * (seen.used - alone) / seen.seconds
    return [
        at_most("page script a frame", 1000 * seen.script / seen.frames, SCRIPT_TARGET_MS, "ms", "six joints, 3-D"),
        at_least("frames, software rendering", frames, FRAMES_TARGET, "1/s"),
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
        at_most("first live data after load", seen.first, FIRST_TARGET_MS, "ms"),
        at_most("first load, compressed", seen.transfer / 1000, TRANSFER_TARGET_KB, "kB", "with 3-D"),
    ]


def _watched(service: RunningService, program: str, seconds: float) -> Seen:
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=program, args=OPTIONS)
        page = browser.new_page(viewport={"width": 1280, "height": 800})
        page.set_default_timeout(PATIENCE)
        page.add_init_script(WATCH)
        session = page.context.new_cdp_session(page)
        received = _received(session)
        session.send("Performance.enable")
        page.goto(f"{service.url}/#/live")
        page.locator("main canvas").first.wait_for()
        page.wait_for_timeout(1000 * WARM_UP)
        before = _now(page, session)
        used = _used_during(service, seconds, page)
        after = _now(page, session)
        first = float(page.evaluate("window.watched.first"))
        latencies = page.evaluate("window.watched.latencies")[before["latencies"] :]
        browser.close()
    return Seen(
        seconds=after["at"] - before["at"],
        script=after["script"] - before["script"],
        frames=int(after["frames"] - before["frames"]),
        latencies=latencies,
        first=first,
        transfer=sum(received),
        used=used,
    )


def _received(session: CDPSession) -> list[int]:
    """Bytes of every answer, as they come; the live socket is no answer."""
    found: list[int] = []
    session.on("Network.loadingFinished", lambda event: found.append(int(event["encodedDataLength"])))
    session.send("Network.enable")
    return found


def _now(page: Page, session: CDPSession) -> dict[str, Any]:
    metrics = {one["name"]: one["value"] for one in session.send("Performance.getMetrics")["metrics"]}
    frames, latencies = page.evaluate("[window.watched.frames, window.watched.latencies.length]")
    return {"at": metrics["Timestamp"], "script": metrics["ScriptDuration"], "frames": frames, "latencies": latencies}


def _used_during(service: RunningService, seconds: float, page: Page | None) -> float:
    """s of processor time that the server's process uses in so many seconds, its owner of the port not counted."""
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
