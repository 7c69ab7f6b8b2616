"""A stream of bytes to one controller, and its only implementation: an open file descriptor."""

from __future__ import annotations

import contextlib
import os
import select
import threading
from collections.abc import Callable
from typing import Protocol

from daq.transport.url import TransportError

READ_SIZE = 4096
WRITE_TIMEOUT_S = 0.5
"""Time after which a port that accepts no byte counts as failed; the largest frame needs 5 ms."""


class ChannelError(TransportError):
    """The connection has ended: the cable, the bridge or its process is gone."""


class ByteChannel(Protocol):
    """Bytes out, bytes in. One thread reads at a time; any thread may write or close."""

    @property
    def description(self) -> str:
        """Description of the far end, for messages."""
        ...

    def read(self, timeout_s: float) -> bytes:
        """What has arrived; empty when nothing has within `timeout_s`. Raises ChannelError at the end."""
        ...

    def write(self, data: bytes) -> None:
        """Hands all of `data` to the operating system. Raises ChannelError when it does not take it."""
        ...

    def close(self) -> None:
        """Ends the connection; a read that waits raises ChannelError. May be called twice."""
        ...


class DescriptorChannel:
    """Channel over a descriptor in non-blocking mode; `release` gives back whatever owns it.

    Reading the descriptor itself costs two system calls a read. pyserial's read(n) waits for n bytes, and how
    many will come is not known here.
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
        """What has arrived; empty at the time-out."""
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
        """All of `data`, or ChannelError."""
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
        """Ends the connection, after whoever reads or writes has left the descriptor."""
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
