"""A mock in lock-step in this process, reached through the bytes of its line alone.

Its time stands still between two turns, so that a process of its own would only cost the change from one to the other.
"""

from __future__ import annotations

import threading
from importlib import import_module
from typing import Protocol

from daq.contracts.extras import require_extra
from daq.transport.channel import ByteChannel, ChannelError
from daq.transport.url import BITS_PER_BYTE, MockPort, TransportError

MODULE = "mock_controller.embedded"
"""Found by its name, as a mock's process is: nothing here knows the mock."""


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
        """The number of a new line; None while there is none to be had."""
        ...

    def take(self, line: int, data: bytes) -> bool:
        """Takes bytes; returns whether the line is whole."""
        ...

    def say(self, line: int) -> bytes | None:
        """What the mock says to them; None where the line is cut."""
        ...

    def close(self) -> None:
        """Ends the mock."""
        ...


class EmbeddedEndpoint:
    """A mock of its own. Raises TransportError with the mock's own words for options that cannot be met;
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
        """URL of the mock's control port, where faults are switched."""
        return self._mock.control

    def waited(self) -> float:
        """Nothing stands still but what the host lets stand."""
        return 0.0

    def connect(self) -> ByteChannel:
        """A new channel to the same mock. Raises TransportError when it has ended, or its line is cut."""
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
    """One line to a mock in this process. Whoever reads lets the mock work; nobody who writes waits for that."""

    description = "the mock controller"

    def __init__(self, mock: Mock, line: int) -> None:
        self._mock = mock
        self._line = line
        self._written = threading.Condition()
        self._unread = b""
        self._closed = False

    def read(self, timeout_s: float) -> bytes:
        """What the mock says; empty when it has nothing to say and nobody writes within `timeout_s`. Raises
        ChannelError at the end."""
        said = self._answers()
        if not said:
            with self._written:
                self._written.wait_for(lambda: self._unread or self._closed, timeout_s)
            said = self._answers()
        return said

    def write(self, data: bytes) -> None:
        """Puts bytes on the line. Raises ChannelError after `close`."""
        with self._written:
            self._check()
            self._unread += data
            self._written.notify()

    def close(self) -> None:
        """Ends the connection; a read that waits raises ChannelError."""
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
