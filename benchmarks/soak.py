"""A thousand runs through one service: do memory, descriptors and threads of its processes stay as they are?

    python -m benchmarks soak [--runs 1000]

Short experiments on a mock in lock-step, queued and followed by REST as any client does, while somebody watches the
live stream; stops, resets and a moment of control come in between. Of each process of the service are read: resident
memory, open descriptors and threads, at the beginning, after a tenth of the runs and at the end. What is loaded or
filled once has been by then; what goes on growing would be seen from there on.
"""

from __future__ import annotations

import argparse
import json
import sys
import tempfile
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from websockets.exceptions import ConnectionClosed
from websockets.sync.client import connect

from benchmarks.figures import Figure, show
from benchmarks.service_process import ROBOT, RunningService, child, started_service

PORT = "mock://?pty=1&lock_step=1&seed=3"
SPEC = {
    "trajectory": {"kind": "ramp", "amplitude": 0.05, "duration": 0.2},
    "joints": [1, 2],
    "settle": 0.0,
    "hold": 0.0,
}
AT_ONCE = 10
"""Experiments that are queued before the last of them is waited for."""
MAY_GROW_MB = 16.0
"""Permitted growth (MB) of resident memory between a tenth of the runs and the end: caches of the database and the live
history fill up, and pages that were freed are not always given back."""


@dataclass(frozen=True)
class Held:
    """Resources that a process holds."""

    memory: float
    """Resident memory (MB)."""
    descriptors: int
    threads: int

    @classmethod
    def by(cls, process: int) -> Held:
        """Now, as Linux tells it."""
        status = dict(
            line.split(":", 1)
            for line in Path(f"/proc/{process}/status").read_text("utf-8").splitlines()
            if ":" in line
        )
        return cls(
            memory=int(status["VmRSS"].split()[0]) / 1024,
            descriptors=len(list(Path(f"/proc/{process}/fd").iterdir())),
            threads=int(status["Threads"]),
        )

    def __str__(self) -> str:
        return f"{self.memory:.1f} MB, {self.descriptors} descriptors, {self.threads} threads"


def soak(service: RunningService, runs: int) -> dict[str, list[Held]]:
    """Held by each process at the beginning, after a tenth, and at the end. Raises RuntimeError for a run that
    fails."""
    processes = {
        "service": service.process.pid,
        "owner of the port": child(service.process.pid, b"server.owner"),
        "stop listener": child(service.process.pid, b"server.stopping"),
    }
    found: dict[str, list[Held]] = {name: [] for name in processes}
    with _watched(service):
        _batch(service)  # what is loaded by the first run is
        for done in range(0, runs + 1, AT_ONCE):
            if done in (0, runs // 10 // AT_ONCE * AT_ONCE, runs):
                _quiet(service)
                for name, process in processes.items():
                    found[name].append(Held.by(process))
            if done < runs:
                _batch(service)
                _in_between(service)
    return found


def _batch(service: RunningService) -> None:
    numbers = [service.submit(SPEC) for _ in range(AT_ONCE)]
    for number in reversed(numbers):  # the last one first: it ends last
        ended = service.ended("experiments", number)
        if ended["state"] != "done":
            raise RuntimeError(f"experiment {number} ended {ended['state']}: {ended['reason']}")


def _in_between(service: RunningService) -> None:
    """A stop, a reset, and a moment of control: what people do between runs."""
    service.ask("POST", "/stop")
    service.reset()
    lease = {"Control-Lease": service.ask("POST", "/control", json={})["lease"]}
    service.ask("PUT", "/gains", json={"gains": {"6": [2, 0, 0]}}, headers=lease)
    service.ask("DELETE", "/control", headers=lease)
    service.ask("POST", "/queue/resume", json={})


def _quiet(service: RunningService) -> None:
    """Waits until nothing is under way and temporary threads have ended."""
    service.ask("GET", "/events", params={"limit": 1})
    time.sleep(1.0)


@contextmanager
def _watched(service: RunningService) -> Iterator[None]:
    """Keeps a watcher on the live stream."""
    address = service.url.replace("http", "ws") + f"/api/v1/robots/{ROBOT}/live"
    with connect(address, max_size=None) as socket:
        socket.send(json.dumps({"subscribe": ["samples", "robot", "queue", "events"], "history": 0}))

        def read() -> None:
            try:
                for _ in socket:
                    pass
            except ConnectionClosed:
                pass

        reader = threading.Thread(target=read)
        reader.start()
        try:
            yield
        finally:
            socket.close()
            reader.join()


def figures(found: dict[str, list[Held]]) -> list[Figure]:
    """Per process: what it held at the three moments, and whether that is flat."""
    table = []
    for name, (begun, tenth, ended) in found.items():
        grown = ended.memory - tenth.memory
        flat = grown <= MAY_GROW_MB and ended.descriptors <= tenth.descriptors and ended.threads <= tenth.threads
        target = f"memory + {MAY_GROW_MB:g} MB at most; no more descriptors, threads"
        table.append(Figure(name, str(ended), target, flat, f"at first {begun}; after a tenth {tenth}"))
    return table


def main() -> int:
    """The exit code: 1 when something grew."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks soak", description=__doc__)
    parser.add_argument("--runs", type=int, default=1000)
    parser.add_argument("--quick", action="store_true", help="100 runs")
    given = parser.parse_args()
    runs = max(AT_ONCE * 10, (100 if given.quick else given.runs) // AT_ONCE * AT_ONCE)
    begun = time.monotonic()
    with tempfile.TemporaryDirectory() as folder, started_service(Path(folder), PORT) as service:
        service.ask("POST", "/connect")
        found = soak(service, runs)
        service.ask("POST", "/disconnect")
    title = f"{runs} runs in lock-step through one service, {time.monotonic() - begun:.0f} s"
    return show(title, f"python -m benchmarks soak --runs {runs}", figures(found))


if __name__ == "__main__":
    sys.exit(main())
