"""A process that stops a robot again and again through each of its doors, and measures until the answer has come."""

from __future__ import annotations

import contextlib
import http.client
import json
import select
import subprocess
import sys
import time
from collections.abc import Iterator
from dataclasses import dataclass, field

ANSWER_WITHIN = 60.0
PAUSE = 0.1
"""Pause (s) between two stops."""


@dataclass
class Stopped:
    """Stops through one door: s until each answer; stops that were not confirmed, and that had no answer."""

    seconds: list[float] = field(default_factory=list)
    unconfirmed: int = 0
    failed: int = 0


@dataclass
class Stops:
    """Stops by address; filled when they have ended."""

    found: dict[str, Stopped] = field(default_factory=dict)


@contextlib.contextmanager
def stopping(host: str, doors: dict[str, int], path: str) -> Iterator[Stops]:
    """Stops while the block runs."""
    stops = Stops()
    command = [
        sys.executable,
        "-c",
        "from benchmarks.stopper import stop_again_and_again as s; s()",
        host,
        json.dumps(doors),
        path,
    ]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdin is not None
        assert process.stdout is not None
        try:
            yield stops
        finally:
            process.stdin.close()
            found = json.loads(process.stdout.read() or "{}")
            stops.found = {door: Stopped(**measured) for door, measured in found.items()}


def _stop(host: str, port: int, path: str, stopped: Stopped) -> None:
    begun = time.monotonic()
    line = http.client.HTTPConnection(host, port, timeout=ANSWER_WITHIN)
    try:
        line.request("POST", path)
        answer = json.loads(line.getresponse().read())
        stopped.unconfirmed += not answer.get("confirmed", False)
    except (OSError, http.client.HTTPException, ValueError):
        stopped.failed += 1
    finally:
        line.close()
    stopped.seconds.append(time.monotonic() - begun)


def stop_again_and_again() -> None:
    """Runs in the process until the other end of its input is closed."""
    host, doors, path = sys.argv[1], json.loads(sys.argv[2]), sys.argv[3]
    found = {door: Stopped() for door in doors}
    while not select.select([sys.stdin], [], [], PAUSE)[0]:
        for door, port in doors.items():
            _stop(host, port, path, found[door])
    json.dump({door: vars(stopped) for door, stopped in found.items()}, sys.stdout)
