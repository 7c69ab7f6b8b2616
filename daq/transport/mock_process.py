"""A mock controller as a child process: started, found by the line it prints, and ended with its owner."""

from __future__ import annotations

import json
import os
import select
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass, field
from typing import IO

from daq.contracts.extras import require_extra
from daq.transport.url import SERVOS, MockPort, TransportError

START_TIMEOUT_S = 30.0
"""Longest time for a mock to start: the first import of the physics engine from a cold disk takes seconds."""
END_TIMEOUT_S = 3.0
LAST_WORDS = 500
"""Characters of the mock's error output that are shown when it does not start."""


@dataclass
class MockProcess:
    """A running mock. It ends when its standard input does, so it never outlives its owner, however that ends."""

    url: str
    """Port URL of its line."""
    control: str | None
    """URL of its control port, where faults are switched."""
    _process: subprocess.Popen[bytes] = field(repr=False)

    def check_running(self) -> None:
        """Raises TransportError when the process has ended."""
        code = self._process.poll()
        if code is not None:
            raise TransportError(f"the mock controller has ended (exit code {code})")

    def close(self) -> None:
        """Ends the process and waits for it. May be called twice."""
        for pipe in (self._process.stdin, self._process.stdout):
            if pipe is not None:
                pipe.close()
        self._process.terminate()
        try:
            self._process.wait(END_TIMEOUT_S)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()


def start_mock(port: MockPort) -> MockProcess:
    """Starts a mock and waits until it listens. Raises TransportError with the mock's own words when it does
    not; MissingExtraError."""
    if port.dialect != SERVOS:
        require_extra("robot", "the mock controller", "mujoco")
    where = ("--pty",) if port.through_pty else ("--tcp", "127.0.0.1:0")
    module = "mock_controller.servos" if port.dialect == SERVOS else "mock_controller"
    command = [sys.executable, "-m", module, *where, "--owned", *port.arguments]
    with tempfile.TemporaryFile() as complaints:
        process = subprocess.Popen(
            command,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=complaints,
            start_new_session=True,  # Ctrl-C is the host's to handle: it needs the mock to confirm the stop
        )
        assert process.stdout is not None
        try:
            ready = json.loads(_first_line(process.stdout))
            return MockProcess(ready["url"], ready.get("control"), process)
        except (ValueError, KeyError, TypeError) as error:
            MockProcess("", None, process).close()
            complaints.seek(0)
            words = complaints.read().decode(errors="replace").strip()[-LAST_WORDS:]
            last_line = words.splitlines()[-1] if words else "it said nothing"
            raise TransportError(f"the mock controller did not start: {last_line}") from error


def _first_line(output: IO[bytes]) -> bytes:
    """The first line that a process prints; what there is when it ends or START_TIMEOUT_S have passed."""
    deadline = time.monotonic() + START_TIMEOUT_S
    waiting = select.poll()
    waiting.register(output, select.POLLIN)
    line = b""
    while not line.endswith(b"\n"):
        if not waiting.poll(max(0.0, deadline - time.monotonic()) * 1000):
            break
        byte = os.read(output.fileno(), 1)
        if not byte:
            break
        line += byte
    return line
