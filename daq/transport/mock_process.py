"""Runs a mock controller as a child process, found by the line that it prints; it ends with its owner."""

from __future__ import annotations

import json
import os
import select
import tempfile
import time
from dataclasses import dataclass, field
from typing import IO

from daq.child import PIECE, Child, last_words
from daq.contracts.extras import require_extra
from daq.contracts.processor import processor_time
from daq.transport.url import SERVOS, MockPort, TransportError

START_TIMEOUT_S = 30.0
"""Longest time (s) for a mock to start: the first import of the physics engine from a cold disk takes seconds. Time
that it waits for a processor does not count, up to STARVED_TIMEOUT_S."""
STARVED_TIMEOUT_S = 300.0
"""Longest time (s) for a mock to start on a computer that gives it no processor time, after which the user needs an
answer."""
END_TIMEOUT_S = 3.0
LAST_WORDS = 500
"""Most characters shown of the mock's error output if it does not start."""


@dataclass
class MockProcess:
    """A running mock. It ends when its standard input ends, so it never outlives its owner."""

    url: str
    """Port URL of its line."""
    control: str | None
    """URL of its control port, for switching faults."""
    _process: Child = field(repr=False)
    _waited_us: int = 0

    def waited(self) -> float:
        """Time (s) for which its board's clock has stood still for lack of processor time."""
        while told := _available(self._process.output):
            lines = [json.loads(line) for line in told.splitlines()]
            self._waited_us = max([self._waited_us, *(line.get("waited_us", 0) for line in lines)])
        return self._waited_us * 1e-6

    def check_running(self) -> None:
        """Raises TransportError if the process has ended."""
        if self._process.code is not None:
            raise TransportError(f"the mock controller has ended (exit code {self._process.code})")

    def close(self) -> None:
        """Ends the process and waits for it. May be called twice."""
        self._process.end_input()
        self._process.terminate()
        self._process.close(END_TIMEOUT_S)


def start_mock(port: MockPort, *, waits: bool = False) -> MockProcess:
    """Starts a mock and waits until it listens. With `waits`, the mock stops its board's clock while it gets no
    processor time; the host can then read for how long (`waited`).

    Raises TransportError with the mock's error output if it does not start; MissingExtraError.
    """
    if port.dialect != SERVOS:
        require_extra("robot", "the mock controller", "mujoco")
    where = ("--pty",) if port.through_pty else ("--tcp", "127.0.0.1:0")
    module = "mock_controller.servos" if port.dialect == SERVOS else "mock_controller"
    waiting = ("--waits",) if waits and port.dialect != SERVOS else ()
    begun = time.monotonic()
    with tempfile.TemporaryFile() as complaints:
        process = Child(module, *where, "--owned", *waiting, *port.arguments, complaints=complaints)
        try:
            ready = json.loads(_first_line(process.output, process.pid))
            os.set_blocking(process.output.fileno(), False)
            return MockProcess(ready["url"], ready.get("control"), process)
        except (ValueError, KeyError, TypeError) as error:
            seconds = time.monotonic() - begun
            # A process that ends closes its output a moment before.
            code = process.wait(0.0 if seconds >= START_TIMEOUT_S else END_TIMEOUT_S)
            MockProcess("", None, process).close()
            complaints.seek(0)
            words = complaints.read().decode(errors="replace").strip()[-LAST_WORDS:]
            last_line = last_words(words) if words else _silent(code, seconds)
            raise TransportError(f"the mock controller did not start: {last_line}") from error


def _available(output: IO[bytes]) -> bytes:
    """Returns the complete lines that have arrived. The process writes whole lines."""
    try:
        return os.read(output.fileno(), PIECE)
    except BlockingIOError:
        return b""


def _silent(code: int | None, seconds: float) -> str:
    """Returns why a mock may have printed nothing in this time. `code`: its exit code; None if it was still
    starting."""
    if code is None:
        return f"it was not ready after {seconds:.0f} s; see what keeps this computer busy, and try again"
    if code < 0:
        return f"signal {-code} ended it; see whether this computer is out of memory, and try again"
    return f"it ended with exit code {code} and gave no reason"


def _first_line(output: IO[bytes], process: int) -> bytes:
    """Returns the first line that a process prints, or the output so far when it ends or its time is over."""
    begun = time.monotonic()
    waiting = select.poll()
    waiting.register(output, select.POLLIN)
    line = b""
    while not line.endswith(b"\n"):
        counted = processor_time(process)
        patience = START_TIMEOUT_S + (0.0 if counted is None else counted.waited)
        left = begun + min(patience, STARVED_TIMEOUT_S) - time.monotonic()
        if left <= 0:
            break
        if not waiting.poll(left * 1000):  # the process may have waited for a processor meanwhile
            continue
        byte = os.read(output.fileno(), 1)
        if not byte:
            break
        line += byte
    return line
