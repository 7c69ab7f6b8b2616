"""One arm shared by 50 watchers, 100 requests a second and a fit: ticks lost, jitter added, stops, plain GETs.

    python -m benchmarks service_load

The mock behind a pseudo-terminal at 115200 baud, the service, its worker process that fits, and all clients share this
machine's cores. First an experiment is recorded while nobody watches, then another one under the whole load; the
second's jitter, less the first's, is what the load adds. Then experiments are stopped by REST at random moments, under
the same load; the moments of a stop are the mock's own record, on the clock that all processes of a machine share.
"""

from __future__ import annotations

import argparse
import contextlib
import http.client
import json
import math
import os
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from urllib.parse import urlsplit

from benchmarks.figures import Figure, at_most, none, quantile, show
from benchmarks.mock_process import MockControl, started_mock
from benchmarks.service_clients import Seen, clients
from benchmarks.service_process import ROBOT, RunningService, child, children, dice, ramp, started_service, sway
from benchmarks.stop_latency import record_of_stop
from daq.contracts.processor import processor_time
from daq.contracts.service.system import stop_port_after
from daq.traces.reader import read_trace

BAUD = 115200
WATCHERS = 50
RATE = 100.0
API = f"/api/v1/robots/{ROBOT}"
PATHS = (API, f"{API}/queue", f"{API}/experiments?limit=20", f"{API}/traces?limit=20", "/healthz")
JITTER_TARGET_MS = 5.0
FROZEN_TARGET_MS = 30.0
USED_TARGET_MS = 55.0
GET_TARGET_MS = 10.0
OTHERS = "other programs"
OWN_DOOR, STOP_DOOR = "through the service", "through the stop listener"
FIT = {"kind": "fit", "method": "nelder_mead", "starts": 20}
FITS = 20
"""Number of fits that are queued: more than are computed meanwhile."""


@dataclass
class Measured:
    """Results of one run. Times in s."""

    endings: list[str] = field(default_factory=list)
    """Ends of experiments that were not completed."""
    idle: list[float] = field(default_factory=list)
    """Jitter of the samples that nobody watched."""
    loaded: list[float] = field(default_factory=list)
    lost: tuple[int, int] = (0, 0)
    """Lost ticks under load, and the number of ticks."""
    frozen: dict[str, list[float]] = field(default_factory=lambda: {OWN_DOOR: [], STOP_DOOR: []})
    used: dict[str, list[float]] = field(default_factory=lambda: {OWN_DOOR: [], STOP_DOOR: []})
    unconfirmed: int = 0
    fitting: int = 0
    """Number of stops during which the fit was still running."""
    busy: dict[str, float] = field(default_factory=dict)
    """Share of one core that each process took while the second experiment was recorded."""
    seen: Seen = field(default_factory=Seen)


def jitter(path: Path) -> tuple[list[float], int]:
    """Returns the delay (s) of each sample after its tick beyond that of the quickest one, and the number of lost
    ticks.
    """
    trace = read_trace(path)
    assert trace.tick is not None
    assert trace.host_time is not None
    after = trace.host_time - (trace.record.period or 0.02) * trace.tick
    return (after - after.min()).tolist(), trace.missing


def ready_again(service: RunningService) -> None:
    """Makes the robot ready after an incomplete run."""
    service.reset()
    service.ask("POST", "/queue/resume", json={})


def record(service: RunningService, seconds: float, found: Measured) -> tuple[list[float], int]:
    """Records an experiment of some length; one that ends early is noted, and measured as far as it came."""
    ended = service.ended("experiments", service.submit(sway(seconds)))
    if ended["state"] != "done":
        found.endings.append(f"{ended['state']}: {ended['reason']}")
        ready_again(service)
    file = service.ask("GET", f"/traces/{ended['trace']}")["entry"]["file"]
    return jitter(service.folder / "traces" / file)


class ProcessorTime:
    """Processor time of processes by name, and of everything else on this machine, since its creation."""

    def __init__(self, processes: dict[str, Sequence[int]]) -> None:
        self._processes = processes
        self._begun = time.monotonic()
        self._before = self._now()

    def shares(self) -> dict[str, float]:
        """Returns shares of one core since the beginning."""
        seconds = time.monotonic() - self._begun
        shares = {name: (now - self._before[name]) / seconds for name, now in self._now().items()}
        return shares | {OTHERS: max(0.0, shares[OTHERS] - sum(shares.values()) + shares[OTHERS])}

    def _now(self) -> dict[str, float]:
        own = {
            name: sum(one.ran for one in map(processor_time, numbers) if one)
            for name, numbers in self._processes.items()
        }
        return own | {OTHERS: _machine_time()}


def _machine_time() -> float:
    """Returns the time (s) that all cores of this machine were busy."""
    user, nice, system, _idle, _waiting, *interrupts = map(int, Path("/proc/stat").read_text("utf-8").split()[1:9])
    return (user + nice + system + sum(interrupts)) / os.sysconf("SC_CLK_TCK")


def stop(line: http.client.HTTPConnection) -> tuple[float, bool]:
    """Returns the time of the stop request, and whether the board confirmed it."""
    at = time.monotonic()
    line.request("POST", f"{API}/stop")
    return at, bool(json.loads(line.getresponse().read())["confirmed"])


def stop_again_and_again(service: RunningService, control: MockControl, times: int, found: Measured) -> None:
    """Stops experiments while they are recorded, at times that are unrelated to the control period.

    Requests go through the service's own door, on an open connection, and through the stop listener's, which hangs up
    after every stop.
    """
    random, where = dice(1991), urlsplit(service.url)
    assert where.port is not None
    doors = {
        OWN_DOOR: http.client.HTTPConnection(where.hostname or "", where.port, timeout=10),
        STOP_DOOR: http.client.HTTPConnection(where.hostname or "", stop_port_after(where.port), timeout=10),
    }
    doors[OWN_DOOR].connect()
    for number in range(times):
        door = (OWN_DOOR, STOP_DOOR)[number % 2]
        experiment = service.submit(sway(60.0))
        try:
            service.until_recording(experiment)
        except RuntimeError as error:
            found.endings.append(str(error))
            ready_again(service)
            continue
        before = control.ask("state")["stop"]["count"]
        time.sleep(random.uniform(0.0, 0.1))
        at, confirmed = stop(doors[door])
        frozen, used = record_of_stop(control, before + 1)
        found.frozen[door].append(frozen - at)
        found.used[door].append(used - at)
        found.unconfirmed += not confirmed
        found.fitting += fitting(service)
        service.ended("experiments", experiment)
        ready_again(service)
    for line in doors.values():
        line.close()


@contextlib.contextmanager
def fits(service: RunningService, trace: str) -> Iterator[None]:
    """Keeps fits of a trace running within the block."""
    queued = [service.ask("POST", "/jobs", json=FIT | {"traces": [trace]})["id"] for _ in range(FITS)]
    while not fitting(service):
        time.sleep(0.1)
    yield
    for number in reversed(queued):  # a waiting one first, or it would begin
        service.robot.post(f"/jobs/{number}/cancel")  # a 409 means that it has ended


def fitting(service: RunningService) -> bool:
    """Whether a fit is running."""
    return bool(service.ask("GET", "/jobs", params={"state": "running"})["items"])


def measure(seconds: float, stops: int) -> Measured:
    """Measures everything in one run."""
    found = Measured()
    with (
        tempfile.TemporaryDirectory() as name,
        started_mock("--pty", "--baud", str(BAUD)) as mock,
        MockControl(mock.control) as control,
        started_service(Path(name), f"{mock.url}?baud={BAUD}") as service,
    ):
        service.ask("POST", "/connect")
        found.idle, _ = record(service, seconds, found)
        short = service.ended("experiments", service.submit(ramp(duration=1.0)))["trace"]
        job = {"kind": "compare", "traces": [short], "models": ["machine"]}
        service.ended("jobs", service.ask("POST", "/jobs", json=job)["id"])
        with clients(service.url, WATCHERS, PATHS, RATE, f"{API}/live") as load, fits(service, short):
            load.begin_anew()
            processes = {
                "service": [service.process.pid],
                "owner of the port": [child(service.process.pid, b"server.owner")],
                "jobs": list(children(service.process.pid, b"spawn_main")),
                "mock": [mock.number],
                **{name: [number] for name, number in load.processes.items()},
                "stops and questions": [os.getpid()],
            }
            spent = ProcessorTime(processes)
            found.loaded, lost = record(service, seconds, found)
            found.busy = spent.shares()
            found.lost = (lost, len(found.loaded))
            stop_again_and_again(service, control, stops, found)
        found.seen = load.seen
        service.ask("POST", "/disconnect")
    return found


def figures_of(found: Measured) -> list[Figure]:
    """Returns the table."""
    idle, loaded = (1e3 * quantile(times, 0.99) for times in (found.idle, found.loaded))
    lost, count = found.lost
    seen = found.seen
    gets, late = ([1e3 * one for one in times] for times in (seen.latencies, seen.own_lateness))

    def spread(times: list[float]) -> str:
        return f"p50 {quantile(times, 0.5):.1f}, max {max(times):.1f} ms"

    stops = []
    for what, target, doors in (
        ("frozen in memory", FROZEN_TARGET_MS, found.frozen),
        ("first used", USED_TARGET_MS, found.used),
    ):
        for door, times in doors.items():
            ms = [1e3 * one for one in times] or [math.inf]
            beside = f"{spread(ms)}, {len(times)} stops"
            stops.append(at_most(f"stop {door}: {what}, p99", quantile(ms, 0.99), target, "ms", beside))
    busy = ", ".join(f"{name} {100 * share:.0f} %" for name, share in found.busy.items())
    own = f"the clients' own lateness p99 {quantile(late, 0.99):.1f} ms"
    return [
        none("experiments not completed", len(found.endings), "; ".join(found.endings)),
        none("ticks lost", lost, f"of {count}"),
        at_most(
            "tick jitter added, p99", loaded - idle, JITTER_TARGET_MS, "ms", f"p99 {loaded:.2f} ms, alone {idle:.2f} ms"
        ),
        *stops,
        none(
            "stops without confirmation",
            found.unconfirmed,
            f"a fit ran beside {found.fitting} of {sum(map(len, found.used.values()))}",
        ),
        at_most("plain GET, p99", quantile(gets, 0.99), GET_TARGET_MS, "ms", f"{spread(gets)}, {len(gets)} requests"),
        none("requests refused", seen.refused, own),
        Figure("processor time, of one core", f"{100 * sum(found.busy.values()):.0f} %", beside=busy),
        Figure("until all watchers had the last 60 s", f"{seen.joining:.2f} s", beside="all of them join at once"),
        none(
            "samples that a watcher did not get",
            seen.samples_missed,
            f"of {seen.samples}, {seen.watchers} watchers, {seen.ended_early} dropped",
        ),
    ]


def main() -> int:
    """Returns the exit code: 1 when a target was missed."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks service_load", description=__doc__)
    parser.add_argument("--seconds", type=float, default=30.0, help="length of each of the two recordings")
    parser.add_argument("--stops", type=int, default=60)
    given = parser.parse_args()
    found = measure(given.seconds, given.stops)
    title = f"{WATCHERS} watchers, {RATE:g} GETs a second, a fit; 50 Hz at {BAUD} baud"
    return show(title, "python -m benchmarks service_load", figures_of(found))


if __name__ == "__main__":
    sys.exit(main())
