"""Eight arms in one service: ticks lost by each while one is killed, one floods, one is pulled.

    python -m benchmarks fleet

Eight mocks, the service and the process that owns each port share this machine's cores. The same experiment is recorded
on all arms twice: first undisturbed, then while the process that owns the first arm's port is killed (SIGKILL), the
second arm's line delivers noise as quickly as it is read, and the third arm's line is cut for good. The other five must
lose no tick. How late samples come says how near to it they were; the machine's load stands in the head of the table.
"""

from __future__ import annotations

import argparse
import contextlib
import os
import select
import signal
import socket
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import httpx

from benchmarks.figures import Figure, quantile, show
from benchmarks.mock_process import started_mock
from benchmarks.own_environment import environment_of
from benchmarks.service_load import jitter
from benchmarks.service_process import ANSWER_WITHIN, COMMAND, END_WITHIN, ENDS, sway

KILLED, FLOODING, PULLED = "arm1", "arm2", "arm3"
PIECE = 65536
DISTURBED_AFTER = 0.4
"""Share of the experiment after which the three arms are disturbed."""


class Line:
    """A line between the service and a mock, which can be flooded and cut."""

    def __init__(self, url: str) -> None:
        host, _, port = url.removeprefix("tcp://").partition("?")[0].rpartition(":")
        self._mock = (host, int(port))
        self._listener = socket.create_server(("127.0.0.1", 0))
        self.url = f"tcp://127.0.0.1:{self._listener.getsockname()[1]}"
        self._ends: list[socket.socket] = []
        self._is_cut = False
        self.flooded = 0
        """Number of bytes of noise that were read."""
        threading.Thread(target=self._accept, daemon=True).start()

    def flood(self, until: float) -> None:
        """Sends noise to the service until this time (s, monotonic), as quickly as it is read."""
        noise, service = os.urandom(PIECE), self._ends[-1]
        with contextlib.suppress(OSError, ValueError):  # the service has hung up
            while time.monotonic() < until:
                _, may_write, _ = select.select([], [service], [], 0.05)
                if may_write:
                    self.flooded += service.send(noise, socket.MSG_DONTWAIT)

    def cut(self) -> None:
        """Ends the line for good."""
        self._is_cut = True
        self._listener.close()
        for end in self._ends:
            with contextlib.suppress(OSError):
                end.shutdown(socket.SHUT_RDWR)

    def _accept(self) -> None:
        with contextlib.suppress(OSError):
            while not self._is_cut:
                service, _ = self._listener.accept()
                mock = socket.create_connection(self._mock)
                for end in (service, mock):
                    end.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
                self._ends += [mock, service]
                for source, target in ((service, mock), (mock, service)):
                    threading.Thread(target=self._carry, args=(source, target), daemon=True).start()

    @staticmethod
    def _carry(source: socket.socket, target: socket.socket) -> None:
        with contextlib.suppress(OSError):
            while piece := source.recv(PIECE):
                target.sendall(piece)
        for end in (source, target):
            with contextlib.suppress(OSError):
                end.shutdown(socket.SHUT_RDWR)


@dataclass
class FleetUnderTest:
    """A service with several arms."""

    process: subprocess.Popen[bytes]
    folder: Path
    client: httpx.Client

    def ask(self, method: str, path: str, **request: Any) -> Any:
        """The answer's JSON. Raises RuntimeError for anything but a 2xx."""
        answer = self.client.request(method, path, **request)
        if not answer.is_success:
            raise RuntimeError(f"{method} {path}: {answer.status_code} {answer.text}")
        return answer.json()

    def until_recording(self, robot: str, experiment: str) -> None:
        """Waits until the record of an experiment has begun. Raises RuntimeError when it ends before."""
        while True:
            found = self.ask("GET", f"/robots/{robot}/experiments/{experiment}", params={"wait": 0.1})
            if found["state"] == "running" and " of " in found["progress_text"]:
                return
            if found["state"] in ENDS:
                raise RuntimeError(f"{robot}: ended {found['state']}: {found['reason']}")

    def ended(self, robot: str, experiment: str) -> dict[str, Any]:
        """Waits for the end of an experiment."""
        while True:
            found: dict[str, Any] = self.ask("GET", f"/robots/{robot}/experiments/{experiment}", params={"wait": 30})
            if found["state"] in ENDS:
                return found

    def owner(self, robot: str) -> int:
        """The process that owns a robot's port, from the name of its stop socket."""
        (path,) = (self.folder / "run").rglob(f"{robot}-*.sock")
        return int(path.stem.rpartition("-")[2])


@contextlib.contextmanager
def started_fleet(folder: Path, ports: dict[str, str]) -> Iterator[FleetUnderTest]:
    """A service with a robot at each of these ports, by name."""
    tables = "".join(f'[robots.{name}]\nport = "{url}"\n' for name, url in ports.items())
    (folder / "daq.toml").write_text(f"{tables}[server]\nconnect_at_start = false\n", "utf-8")
    environment = environment_of(folder) | {"DAQ_RUNTIME_FOLDER": str(folder / "run")}
    with (folder / "service.log").open("ab") as log:
        process = subprocess.Popen(
            [*COMMAND, "serve", "--port", "0"], cwd=folder, env=environment, stdout=subprocess.PIPE, stderr=log
        )
    assert process.stdout is not None
    try:
        url = process.stdout.readline().decode().strip()
        if not url:
            raise RuntimeError(f"the service did not start: {(folder / 'service.log').read_text('utf-8')[-500:]}")
        with httpx.Client(base_url=f"{url}/api/v1", timeout=ANSWER_WITHIN) as client:
            yield FleetUnderTest(process, folder, client)
    finally:
        process.terminate()
        try:
            process.wait(END_WITHIN)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()
        process.stdout.close()


@dataclass(frozen=True)
class Recorded:
    """One arm's experiment: how it ended, its lost ticks out of how many, how late samples came (s)."""

    state: str
    lost: int
    ticks: int
    late: float

    @property
    def text(self) -> str:
        """In one line."""
        return f"{self.lost} of {self.ticks} ticks lost, p99 {self.late * 1e3:.1f} ms late, {self.state}"


def recorded(fleet: FleetUnderTest, robot: str, experiment: str) -> Recorded:
    """Waits for the end of an experiment, and reads its trace."""
    ended = fleet.ended(robot, experiment)
    try:
        file = fleet.ask("GET", f"/robots/{robot}/traces/{ended['trace']}")["entry"]["file"]
    except RuntimeError:  # a killed owner's trace is found when the robot is connected again
        return Recorded(f"{ended['state']}, no trace yet", 0, 0, 0.0)
    late, lost = jitter(fleet.folder / "traces" / robot / file)
    return Recorded(ended["state"], lost, len(late) + lost, quantile(late, 0.99))


def run(fleet: FleetUnderTest, seconds: float, lines: dict[str, Line] | None) -> dict[str, Recorded]:
    """Records the experiment on all arms. With `lines`, disturbs three of the arms meanwhile."""
    made = fleet.ask("POST", "/fleet/experiments", json={"request": {"spec": sway(seconds)}})["experiments"]
    for one in made:
        fleet.until_recording(one["robot"], one["id"])
    print(f"recording on {len(made)} arms", file=sys.stderr, flush=True)
    if lines is not None:
        time.sleep(DISTURBED_AFTER * seconds)
        flooding = threading.Thread(target=lines[FLOODING].flood, args=(time.monotonic() + 0.4 * seconds,))
        os.kill(fleet.owner(KILLED), signal.SIGKILL)
        flooding.start()
        lines[PULLED].cut()
        flooding.join()
    return {one["robot"]: recorded(fleet, one["robot"], one["id"]) for one in made}


def measure(arms: int, seconds: float) -> tuple[dict[str, Recorded], dict[str, Recorded], int, dict[str, Any]]:
    """The undisturbed run, the disturbed one, bytes of noise that were read, and the arms' states at the end."""
    names = [f"arm{number}" for number in range(1, arms + 1)]
    with contextlib.ExitStack() as stack:
        folder = Path(stack.enter_context(tempfile.TemporaryDirectory()))
        mocks = [stack.enter_context(started_mock("--tcp", "127.0.0.1:0", "--seed", str(seed))) for seed in range(arms)]
        lines = {name: Line(mock.url) for name, mock in zip(names, mocks, strict=True)}
        fleet = stack.enter_context(started_fleet(folder, {name: line.url for name, line in lines.items()}))
        for name in names:
            fleet.ask("POST", f"/robots/{name}/connect")
            fleet.ask("POST", f"/robots/{name}/queue/resume", json={})
        undisturbed = run(fleet, seconds, None)
        for name in names:
            fleet.ask("POST", f"/robots/{name}/queue/resume", json={})
        disturbed = run(fleet, seconds, lines)
        states = {one["robot"]: one for one in fleet.ask("GET", "/fleet")["robots"]}
        return undisturbed, disturbed, lines[FLOODING].flooded, states


def main() -> int:
    """Measures and prints. The exit code is 1 when an undisturbed arm has lost a tick, or its experiment."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--arms", type=int, default=8, help="number of arms, four at least")
    parser.add_argument("--quick", action="store_true", help="experiments of 8 s in place of 40 s")
    given = parser.parse_args()
    undisturbed, disturbed, flooded, states = measure(max(4, given.arms), 8.0 if given.quick else 40.0)
    what = {KILLED: "killed", FLOODING: f"floods ({flooded / 1e6:.0f} MB)", PULLED: "pulled"}
    figures = []
    for name, found in disturbed.items():
        own = name not in what
        met = (found.lost == 0 and found.state == "done" and not states[name]["queue"]["paused"]) if own else None
        beside = f"before: {undisturbed[name].text}"
        title = f"{name}, {what.get(name, 'left alone')}"
        figures.append(Figure(title, found.text, "0 ticks, done, queue open" if own else "", met, beside))
    return show(
        "Eight arms in one service" if len(disturbed) == 8 else "Arms in one service",
        "python -m benchmarks fleet",
        figures,
    )


if __name__ == "__main__":
    raise SystemExit(main())
