"""Runs a lock-step mock in this process, reached only through the bytes of its line.

Its time stands still between two requests, so a separate process would only add process switches.
"""

from __future__ import annotations

import threading
from importlib import import_module
from typing import Protocol

from daq.contracts.extras import require_extra
from daq.transport.channel import ByteChannel, ChannelError
from daq.transport.url import BITS_PER_BYTE, MockPort, TransportError

MODULE = "mock_controller.embedded"
"""Imported by name, since nothing here depends on the mock."""


class Mock(Protocol):
    """A mock, and the line to it."""

    @property
    def control(self) -> str:
        """URL of its control port."""
        ...

    @property
    def ended(self) -> bool:
        """Whether it has ended."""
        ...

    def open_line(self) -> int | None:
        """Opens a line and returns its number; None if none is available."""
        ...

    def take(self, line: int, data: bytes) -> bool:
        """Passes bytes to the mock. Returns whether the line is intact."""
        ...

    def say(self, line: int) -> bytes | None:
        """Returns the mock's answer to them; None if the line is cut."""
        ...

    def close(self) -> None:
        """Ends the mock."""
        ...


class EmbeddedEndpoint:
    """A mock in this process. Raises TransportError with the mock's own message for invalid options;
    MissingExtraError."""

    lock_step = True

    def __init__(self, url: str, port: MockPort) -> None:
        require_extra("robot", "the mock controller", "mujoco")
        self.url = url
        self.bytes_per_second = port.baud / BITS_PER_BYTE
        try:
            self._mock: Mock = import_module(MODULE).EmbeddedMock(port.arguments)
        except ValueError as error:
            raise TransportError(f"the mock controller did not start: {error}") from error

    @property
    def control(self) -> str | None:
        """URL of the mock's control port, for switching faults."""
        return self._mock.control

    def waited(self) -> float:
        """Returns 0: only the host stops this mock's time."""
        return 0.0

    def connect(self) -> ByteChannel:
        """Opens a new channel to the same mock. Raises TransportError if the mock has ended, or its line is cut."""
        if self._mock.ended:
            raise TransportError("the mock controller has ended")
        line = self._mock.open_line()
        if line is None:
            raise TransportError("the line to the mock controller is cut")
        return EmbeddedChannel(self._mock, line)

    def close(self) -> None:
        """Ends the mock."""
        self._mock.close()


class EmbeddedChannel:
    """One line to a mock in this process. The mock runs on the reading thread, so writing never waits for it."""

    description = "the mock controller"

    def __init__(self, mock: Mock, line: int) -> None:
        self._mock = mock
        self._line = line
        self._written = threading.Condition()
        self._unread = b""
        self._closed = False

    def read(self, timeout_s: float) -> bytes:
        """Returns the mock's answer; empty if it has none and nothing is written within `timeout_s`. Raises
        ChannelError at the end."""
        said = self._answers()
        if not said:
            with self._written:
                self._written.wait_for(lambda: self._unread or self._closed, timeout_s)
            said = self._answers()
        return said

    def write(self, data: bytes) -> None:
        """Writes bytes to the line. Raises ChannelError after `close`."""
        with self._written:
            self._check()
            self._unread += data
            self._written.notify()

    def close(self) -> None:
        """Closes the connection; a waiting read raises ChannelError."""
        with self._written:
            self._closed = True
            self._written.notify_all()

    def _answers(self) -> bytes:
        with self._written:
            self._check()
            data, self._unread = self._unread, b""
        whole = not data or self._mock.take(self._line, data)
        said = self._mock.say(self._line) if whole else None
        if said is None:
            raise ChannelError(f"{self.description}: connection ended by the other side")
        return said

    def _check(self) -> None:
        if self._closed:
            raise ChannelError(f"{self.description}: closed")
