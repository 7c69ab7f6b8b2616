"""A byte stream to one controller, implemented by an open file descriptor."""

from __future__ import annotations

import contextlib
import os
import select
import threading
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Protocol

from daq.transport.url import TransportError

READ_SIZE = 4096
WRITE_TIMEOUT_S = 0.5
"""Time (s) after which a port that accepts no bytes counts as failed; the largest frame needs 5 ms."""


class ChannelError(TransportError):
    """The connection ended: the cable, the bridge or its process is gone."""


class ByteChannel(Protocol):
    """Writes and reads bytes. One thread reads at a time; any thread may write or close."""

    @property
    def description(self) -> str:
        """Description of the far end, for messages."""
        ...

    def read(self, timeout_s: float) -> bytes:
        """Returns the bytes that have arrived; empty if none come within `timeout_s`. Raises ChannelError at the
        end."""
        ...

    def write(self, data: bytes) -> None:
        """Passes all of `data` to the operating system. Raises ChannelError if it does not accept them."""
        ...

    def close(self) -> None:
        """Closes the connection; a waiting read raises ChannelError. May be called twice."""
        ...


class DescriptorChannel:
    """A channel over a descriptor in non-blocking mode; `release` frees its owner.

    Reading the descriptor directly takes two system calls per read. pyserial's read(n) would wait for n bytes, but the
    number to come is unknown.
    """

    def __init__(self, descriptor: int, description: str, release: Callable[[], None]) -> None:
        os.set_blocking(descriptor, False)
        self._descriptor = descriptor
        self._description = description
        self._release = release
        self._wake_reader, self._wake_writer = os.pipe()
        self._incoming = select.poll()
        self._incoming.register(descriptor, select.POLLIN)
        self._incoming.register(self._wake_reader, select.POLLIN)
        self._in_use = threading.Lock()
        self._writing = threading.Lock()
        self._closed = False
        self._released = False

    @property
    def description(self) -> str:
        """Description of the far end."""
        return self._description

    def read(self, timeout_s: float) -> bytes:
        """Returns the bytes that have arrived; empty after the time-out."""
        with self._in_use:
            if self._closed:
                raise ChannelError(f"{self._description}: closed")
            if not self._incoming.poll(max(0.0, timeout_s) * 1000):
                return b""
            if self._closed:
                raise ChannelError(f"{self._description}: closed")
            try:
                data = os.read(self._descriptor, READ_SIZE)
            except BlockingIOError:
                return b""
            except OSError as error:
                raise ChannelError(f"{self._description}: connection lost ({error.strerror})") from error
        if not data:
            raise ChannelError(f"{self._description}: connection ended by the other side")
        return data

    def write(self, data: bytes) -> None:
        """Writes all of `data`, or raises ChannelError."""
        rest = memoryview(data)
        with self._writing:
            while rest:
                if self._closed:
                    raise ChannelError(f"{self._description}: closed")
                try:
                    rest = rest[os.write(self._descriptor, rest) :]
                except BlockingIOError:
                    self._wait_until_writable()
                except OSError as error:
                    raise ChannelError(f"{self._description}: connection lost ({error.strerror})") from error

    def close(self) -> None:
        """Closes the connection, once no thread uses the descriptor any more."""
        self._closed = True
        if not self._released:
            with contextlib.suppress(OSError):
                os.write(self._wake_writer, b"\0")
        with self._in_use, self._writing:
            if self._released:
                return
            self._released = True
            self._release()
            os.close(self._wake_reader)
            os.close(self._wake_writer)

    def _wait_until_writable(self) -> None:
        outgoing = select.poll()
        outgoing.register(self._descriptor, select.POLLOUT)
        if not outgoing.poll(WRITE_TIMEOUT_S * 1000):
            raise ChannelError(f"{self._description}: takes no more bytes (nothing sent for {WRITE_TIMEOUT_S} s)")


# ---- Delays between attempts to reconnect: doubled up to a limit. Pure


@dataclass(frozen=True)
class ReconnectDelay:
    """Delays (s) before the attempts that follow a lost connection; the first attempt is made at once."""

    first_s: float = 0.1
    longest_s: float = 5.0

    def __post_init__(self) -> None:
        if not 0 < self.first_s <= self.longest_s:
            raise ValueError(f"delays of {self.first_s} to {self.longest_s} s: must be above 0 and ascending")

    def delays(self) -> Iterator[float]:
        """0, first, 2·first, 4·first … longest, longest, …; without end."""
        yield 0.0
        delay = self.first_s
        while True:
            yield delay
            delay = min(2 * delay, self.longest_s)
