"""How long a stop takes at both doors while 200 clients ask as fast as they can and three programs compute.

    python -m benchmarks stop_under_load [--stops 10]

The mock stands behind a pseudo-terminal in lock-step and holds its posture; nobody measures the arm here, but how long
a client waits for the word that the board has confirmed. The clients are one process, each on a connection of its own,
and ask anew as soon as they are answered; the programs that compute have the priority that every program has.
"""

from __future__ import annotations

import argparse
import asyncio
import contextlib
import http.client
import json
import multiprocessing
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path
from urllib.parse import urlsplit

from benchmarks.figures import Figure, at_most, quantile, show
from benchmarks.service_process import ROBOT, RunningService, dice, started_service
from daq.contracts.service.system import stop_port_after

CLIENTS = 200
PROGRAMS = 3
API = f"/api/v1/robots/{ROBOT}"
PATHS = (API, f"{API}/queue", f"{API}/experiments?limit=20", f"{API}/traces?limit=20")
PORT = "mock://?pty=1&lock_step=1&seed=3"
WARM_UP = 3.0
"""Time (s) until all clients are active."""
PATIENCE = 30.0
"""Time-out (s) of one stop; after it the stop counts as unanswered."""
OWN_DOOR, LISTENER = "the service's own door", "the stop listener"
ALONE = 100
"""Number of stops at each address without load."""
OWN_TARGET, LISTENER_TARGET = 3.0, 1.0
"""Targets (s): the time-out of `daq.client` for one address, and a time in which an operator does not press again."""


def compute() -> None:
    """Computes until the process is ended."""
    while True:
        sum(range(100_000))


def ask_on_and_on(host: str, port: int, answered: multiprocessing.sharedctypes.Synchronized[int]) -> None:
    """All clients, until they are ended."""
    asyncio.run(_clients(host, port, answered))


async def _clients(host: str, port: int, answered: multiprocessing.sharedctypes.Synchronized[int]) -> None:
    async def client(number: int) -> None:
        reader, writer = await asyncio.open_connection(host, port)
        while True:
            path = PATHS[number % len(PATHS)]
            number += 1
            writer.write(f"GET {path} HTTP/1.1\r\nHost: {host}:{port}\r\n\r\n".encode())
            head = (await reader.readuntil(b"\r\n\r\n")).decode("latin-1").lower()
            length = head.partition("content-length:")[2].partition("\r\n")[0]
            await reader.readexactly(int(length or 0))
            answered.value += 1

    await asyncio.gather(*(client(number) for number in range(CLIENTS)), return_exceptions=True)


@contextlib.contextmanager
def load(url: str) -> Iterator[multiprocessing.sharedctypes.Synchronized[int]]:
    """Clients and programs within. Yields how many questions have been answered."""
    where, context = urlsplit(url), multiprocessing.get_context("spawn")
    answered = context.Value("q", 0)
    processes = [context.Process(target=ask_on_and_on, args=(where.hostname, where.port, answered), daemon=True)]
    processes += [context.Process(target=compute, daemon=True) for _ in range(PROGRAMS)]
    for process in processes:
        process.start()
    try:
        while answered.value < CLIENTS:
            time.sleep(0.1)
        time.sleep(WARM_UP)
        yield answered
    finally:
        for process in processes:
            process.kill()
            process.join()


def stop(host: str, port: int) -> float | None:
    """Time (s) until a confirmed answer on a new connection; None without an answer."""
    begun = time.monotonic()
    line = http.client.HTTPConnection(host, port, timeout=PATIENCE)
    try:
        line.request("POST", f"{API}/stop")
        if json.loads(line.getresponse().read())["confirmed"]:
            return time.monotonic() - begun
    except (OSError, http.client.HTTPException):
        return None
    finally:
        line.close()
    return None


Times = dict[str, list[float | None]]
"""Times (s) of stops at each address; None for an unanswered one."""


def at_both_doors(url: str, stops: int, pause: float) -> Times:
    """So many stops at each, up to `pause` s after one another."""
    where, random = urlsplit(url), dice(1991)
    assert where.hostname is not None
    assert where.port is not None
    doors = {OWN_DOOR: where.port, LISTENER: stop_port_after(where.port)}
    found: Times = {name: [] for name in doors}
    for _ in range(stops):
        for name, port in doors.items():
            time.sleep(random.uniform(0.0, pause))
            found[name].append(stop(where.hostname, port))
    return found


def measure(service: RunningService, stops: int) -> tuple[Times, Times, float]:
    """Times without load and under it, and how many questions were answered a second meanwhile."""
    alone = at_both_doors(service.url, ALONE, 0.05)
    with load(service.url) as answered:
        before, begun = answered.value, time.monotonic()
        loaded = at_both_doors(service.url, stops, 0.5)
        rate = (answered.value - before) / (time.monotonic() - begun)
    return alone, loaded, rate


def figures_of(alone: Times, loaded: Times, rate: float) -> list[Figure]:
    """The table."""
    figures = []
    for name, times in alone.items():
        known = [PATIENCE if one is None else one for one in times]
        value = f"p50 {1e3 * quantile(known, 0.5):.1f} ms, p99 {1e3 * quantile(known, 0.99):.1f} ms"
        figures.append(Figure(f"stop to its confirmed answer at {name}, without load", value, beside=f"{len(times)}"))
    for name, target in ((OWN_DOOR, OWN_TARGET), (LISTENER, LISTENER_TARGET)):
        known = [PATIENCE if one is None else one for one in loaded[name]]
        silent = sum(one is None for one in loaded[name])
        beside = f"p50 {quantile(known, 0.5):.3f} s, {silent} of {len(known)} not answered"
        figures.append(at_most(f"the same at {name} under load, slowest", max(known), target, "s", beside))
    return [*figures, Figure("questions answered meanwhile", f"{rate:.0f} a second")]


def main() -> int:
    """The exit code: 1 when a target was missed."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks stop_under_load", description=__doc__)
    parser.add_argument("--stops", type=int, default=10, help="at each door")
    parser.add_argument("--quick", action="store_true", help="five stops")
    given = parser.parse_args()
    stops = 5 if given.quick else given.stops
    with tempfile.TemporaryDirectory() as folder, started_service(Path(folder), PORT) as service:
        service.ask("POST", "/connect")
        figures = figures_of(*measure(service, stops))
        service.ask("POST", "/disconnect")
    title = f"Stops while {CLIENTS} clients ask and {PROGRAMS} programs compute"
    return show(title, f"python -m benchmarks stop_under_load --stops {stops}", figures)


if __name__ == "__main__":
    sys.exit(main())
