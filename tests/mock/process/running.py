"""The mock as a process of its own, and a host that reaches it through pyserial."""

import json
import subprocess
import sys
from pathlib import Path
from types import TracebackType
from typing import Any, Self

import serial

from firmware_protocol.dialect import FramedDialect
from firmware_protocol.message import Reply, Request
from tests.control_port import told_by

ROOT = Path(__file__).parents[3]


class RunningMock:
    """`python -m mock_controller` with some arguments; ends with the `with` block."""

    def __init__(self, *arguments: str) -> None:
        self._process = subprocess.Popen(
            [sys.executable, "-m", "mock_controller", "--owned", *arguments],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            cwd=ROOT,
        )
        ready = self.next_line()
        self.url: str = ready["url"]
        self.control_url: str | None = ready["control"]

    def next_line(self) -> dict[str, Any]:
        line = json.loads(self._process.stdout.readline())
        assert line["ready"] is True
        return line  # type: ignore[no-any-return]

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        self.end()

    def end(self) -> int:
        """Ends its standard input, as the death of its owner does; the exit code."""
        self._process.stdin.close()
        code = self._process.wait(10)
        self._process.stdout.close()
        return code

    def interrupt(self) -> int:
        """Sends SIGTERM; the exit code."""
        self._process.terminate()
        return self._process.wait(10)

    def wait(self) -> int:
        """Waits until it has ended by itself; the exit code."""
        return self._process.wait(10)

    def control(self, command: str, **more: object) -> dict[str, Any]:
        """One command to the control port."""
        return told_by(self.control_url, command, **more)


class SerialHost:
    """A host on a pseudo-terminal or TCP, through pyserial."""

    def __init__(self, url: str) -> None:
        if url.startswith("tcp://"):
            self.port = serial.serial_for_url(url.replace("tcp://", "socket://"), timeout=5)
        else:
            self.port = serial.Serial(url.removeprefix("serial://"), 115_200, timeout=5, exclusive=True)
        self.dialect = FramedDialect()
        self.sequence = 0

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        below = getattr(self.port, "_socket", None)
        self.port.close()
        if below is not None:  # which pyserial leaves open when the other end has gone first
            below.close()

    def ask(self, request: Request) -> Reply:
        """The reply to a request."""
        self.sequence += 1
        self.port.write(self.dialect.encode(self.sequence, request))
        while True:
            data = self.port.read(1)
            assert data, "no reply in 5 s"
            for sequence, reply in self.dialect.feed(data):
                if sequence == self.sequence:
                    return reply
