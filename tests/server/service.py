"""A real service for tests: `daq serve` in a process of its own, on a mock behind a pseudo-terminal."""

import os
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, BinaryIO

import httpx

from tests.server.polling import until

DAQ = [sys.executable, "-c", "from daq_cli import main; main()"]
MOCK = "mock://?pty=1&lock_step=1&seed=3"
"""In lock-step: what the arm does depends on no clock, however busy this computer is."""
START_WITHIN = 100.0
END_WITHIN = 60.0
"""Times (s) of a machine that does much else at the same time; alone, it takes two seconds."""


@dataclass
class Service:
    """A running service. `robot` speaks to its robot's part of the API."""

    process: subprocess.Popen[bytes]
    url: str
    folder: Path
    client: httpx.Client
    robot: httpx.Client
    seen: list[dict[str, Any]] = field(default_factory=list)

    def until_connected(self) -> dict[str, Any]:
        """Connects, or waits for the connection that is being made. Its status."""
        answer = self.robot.post("/connect")
        assert answer.status_code == 200, answer.text
        found: dict[str, Any] = answer.json()
        return found

    def status(self) -> dict[str, Any]:
        return self._until("/robots/ma2000", lambda _: True)

    def until_arm(self, state: str) -> dict[str, Any]:
        """Asks until the arm's state is told: a stop is answered before everybody has heard of it. The status."""
        return self._until("/robots/ma2000", lambda found: found["arm"] == state)

    def until_link(self, state: str) -> dict[str, Any]:
        """Asks until the state of the connection to the robot is told. The status."""
        return self._until("/robots/ma2000", lambda found: found["connection"] == state)

    def until_paused(self) -> dict[str, Any]:
        """Asks until the queue is paused: it is some time after what pauses it has been answered. The queue."""
        return self._until("/robots/ma2000/queue", lambda found: found["paused"])

    def end_of(self, number: str, kind: str = "experiments") -> dict[str, Any]:
        """Waits until an experiment (or one of `jobs`) has ended; the test's own time limit ends the wait."""
        path = f"/robots/ma2000/{kind}/{number}"
        while (found := self._until(path, lambda _: True, {"wait": 30}))["state"] in ("queued", "running"):
            self.seen.append(found)
        return found

    def until_recording(self, experiment: str) -> dict[str, Any]:
        """Asks until the record of an experiment has begun."""

        def is_recorded(found: dict[str, Any]) -> bool:
            assert found["state"] in ("queued", "running"), found
            return found["state"] == "running" and " of " in str(found["progress_text"])

        return self._until(f"/robots/ma2000/experiments/{experiment}", is_recorded, {"wait": 0.2})

    def _until(
        self, path: str, is_so: Callable[[dict[str, Any]], bool], params: dict[str, float] | None = None
    ) -> dict[str, Any]:
        found: dict[str, Any] = until(self.client, path, is_so, params, self.process)
        return found

    def end(self, number: int = signal.SIGTERM) -> int:
        """Sends a signal; the exit code."""
        self.process.send_signal(number)
        return self.process.wait(END_WITHIN)


@contextmanager
def serving(
    folder: Path, *words: str, program: Sequence[str] = DAQ, log: BinaryIO | None = None
) -> Iterator[tuple[subprocess.Popen[bytes], str]]:
    """`daq … serve` in a process of its own, and its address. All that it writes lies in `folder`; `program` stands for
    `daq`, `log` is where its log goes."""
    environment = {key: value for key, value in os.environ.items() if not key.startswith("DAQ_")}
    environment |= {"DAQ_RUNTIME_FOLDER": str(folder / "run"), "XDG_CONFIG_HOME": str(folder / "configuration")}
    process = subprocess.Popen([*program, *words], cwd=folder, env=environment, stdout=subprocess.PIPE, stderr=log)
    try:
        assert process.stdout is not None
        url = process.stdout.readline().decode().strip()
        assert url, f"the service did not start: exit code {process.wait()}"
        yield process, url
    finally:
        process.terminate()
        try:
            process.wait(END_WITHIN)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()
        if process.stdout is not None:
            process.stdout.close()


@contextmanager
def running_service(
    folder: Path,
    port: str = MOCK,
    *options: str,
    headers: dict[str, str] | None = None,
    program: Sequence[str] = DAQ,
    log: BinaryIO | None = None,
) -> Iterator[Service]:
    """A service of one robot; the rest as `serving` has it."""
    words = ("--port", port, "serve", "--port", "0", *options)
    with (
        serving(folder, *words, program=program, log=log) as (process, url),
        httpx.Client(base_url=f"{url}/api/v1", timeout=START_WITHIN, headers=headers) as client,
        httpx.Client(base_url=f"{url}/api/v1/robots/ma2000", timeout=START_WITHIN, headers=headers) as robot,
    ):
        yield Service(process, url, folder, client, robot)
        if process.poll() is None:
            robot.post("/disconnect")  # waits longer for the owner of the port than the end of the service does
