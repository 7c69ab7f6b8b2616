"""Runs a service as a separate process on a separate mock, for the measurements of the service."""

from __future__ import annotations

import contextlib
import random
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import httpx

from benchmarks.mock_process import environment_of

ROBOT = "ma2000"
ANSWER_WITHIN = 100.0
END_WITHIN = 15.0
LONGEST_START = 90.0
"""Time (s) within which a queued experiment is being recorded, including its move to the start."""
ENDS = ("done", "failed", "cancelled", "interrupted")
COMMAND = (sys.executable, "-c", "from daq_cli import main; main()")


@dataclass
class RunningService:
    """A service that answers at `url`; `robot` accesses its robot's part of the API."""

    process: subprocess.Popen[bytes]
    url: str
    folder: Path
    robot: httpx.Client

    def ask(self, method: str, path: str, **request: Any) -> Any:
        """Returns the answer's JSON. Raises RuntimeError for anything but a 2xx."""
        answer = self.robot.request(method, path, **request)
        if not answer.is_success:
            raise RuntimeError(f"{method} {path}: {answer.status_code} {answer.text}")
        return answer.json() if answer.content else None

    def reset(self) -> None:
        """Ends the active stop. Raises RuntimeError as `ask` does."""
        address = str(self.robot.base_url).rstrip("/")
        while (found := self.ask("GET", address))["stop"] is None and found["arm"] != "disconnected":
            time.sleep(0.02)  # the owner of the port has yet to read its ID
        self.ask("POST", "/reset", json={"stop": found["stop"] or 0})

    def submit(self, spec: dict[str, Any]) -> str:
        """Queues an experiment; returns its ID."""
        return str(self.ask("POST", "/experiments", json={"spec": spec})["id"])

    def ended(self, kind: str, number: str) -> dict[str, Any]:
        """Waits for the end of an experiment (`experiments`) or a job (`jobs`)."""
        while True:
            found: dict[str, Any] = self.ask("GET", f"/{kind}/{number}", params={"wait": 30})
            if found["state"] in ENDS:
                return found

    def until_recording(self, number: str) -> None:
        """Waits until the record of an experiment has begun. Raises RuntimeError if it ends before, or never begins."""
        give_up = time.monotonic() + LONGEST_START
        while True:
            found = self.ask("GET", f"/experiments/{number}", params={"wait": 0.1})
            if time.monotonic() > give_up:
                raise RuntimeError(f"experiment {number} does not begin: {found}, queue {self.ask('GET', '/queue')}")
            if found["state"] == "running" and " of " in found["progress_text"]:
                return
            if found["state"] in ENDS:
                raise RuntimeError(f"experiment {number} ended {found['state']}: {found['reason']}")

    def kill(self) -> None:
        """Kills this one process as a power cut would."""
        self.process.send_signal(signal.SIGKILL)
        self.process.wait(END_WITHIN)


@contextlib.contextmanager
def started_service(folder: Path, port: str) -> Iterator[RunningService]:
    """Yields `daq serve`, once it answers, and ends it with the block; all its files, including its log, are in
    `folder`.
    """
    command = [*COMMAND, "--port", port, "serve", "--port", "0"]
    with (
        (folder / "service.log").open("ab") as log,
        subprocess.Popen(
            command, cwd=folder, env=environment_of(folder), stdout=subprocess.PIPE, stderr=log
        ) as process,
    ):
        assert process.stdout is not None
        try:
            url = process.stdout.readline().decode().strip()
            if not url:
                raise RuntimeError(f"the service did not start: {(folder / 'service.log').read_text('utf-8')[-500:]}")
            with httpx.Client(base_url=f"{url}/api/v1/robots/{ROBOT}", timeout=ANSWER_WITHIN) as robot:
                yield RunningService(process, url, folder, robot)
        finally:
            process.terminate()
            try:
                process.wait(END_WITHIN)
            except subprocess.TimeoutExpired:
                process.kill()


def ramp(amplitude: float = 0.1, duration: float = 0.5) -> dict[str, Any]:
    """Returns a short experiment on joints 1 to 3."""
    trajectory = {"kind": "ramp", "amplitude": amplitude, "duration": duration}
    return {"trajectory": trajectory, "joints": [1, 2, 3], "settle": 0.1, "hold": 0.1}


def sway(seconds: float) -> dict[str, Any]:
    """Returns an experiment that keeps three joints moving."""
    trajectory = {"kind": "sine", "amplitude": 0.1, "period": 4.0, "cycles": seconds / 4.0}
    return {"trajectory": trajectory, "joints": [1, 2, 3], "settle": 0.2, "hold": 0.2}


def dice(seed: int) -> random.Random:
    """Returns random times that are the same in every run."""
    return random.Random(seed)


def child(process: int, mark: bytes) -> int:
    """Returns the child of a process with this in its command line. Raises RuntimeError without one."""
    found = next(children(process, mark), None)
    if found is None:
        raise RuntimeError(f"process {process} has no child with {mark!r} in its command line")
    return found


def children(process: int, mark: bytes) -> Iterator[int]:
    """Yields the children of a process with this in their command lines, in the order of their start."""
    for thread in Path(f"/proc/{process}/task").iterdir():
        for number in (thread / "children").read_text("utf-8").split():
            if mark in Path(f"/proc/{number}/cmdline").read_bytes():
                yield int(number)
