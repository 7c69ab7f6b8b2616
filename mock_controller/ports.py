"""Addresses of the mock for the host: a pseudo-terminal or a TCP port, for one connection at a time."""

from __future__ import annotations

import contextlib
import os
import pty
import select
import socket
import tty
from abc import ABC, abstractmethod
from pathlib import Path
from urllib.parse import quote

_READ_SIZE = 65536
UNSENT_LIMIT = 65536
"""Most bytes kept for a host that does not read; further ones are lost, as on a line without flow control."""


class PortError(ValueError):
    """An address that cannot be used."""


class Port(ABC):
    """One way to reach the mock. Nothing here waits: bytes that the host does not accept yet are kept."""

    def __init__(self) -> None:
        self._unsent = bytearray()
        self.lost = 0
        """Bytes lost because the host did not read."""

    @property
    @abstractmethod
    def url(self) -> str:
        """URL by which the host opens it."""

    @property
    @abstractmethod
    def watched(self) -> list[int]:
        """File descriptors to wait on for input."""

    @property
    @abstractmethod
    def _line(self) -> int | None:
        """File descriptor of the connection, None without one."""

    @abstractmethod
    def read(self, readable: int) -> bytes | None:
        """Returns the bytes from a readable descriptor; None when the host has gone."""

    @abstractmethod
    def cut(self) -> None:
        """Cuts the line; the host notices it."""

    @abstractmethod
    def restore(self) -> None:
        """Restores the line. Raises PortError if the address is taken."""

    @property
    def waiting_to_write(self) -> list[int]:
        """The descriptor to wait for when bytes are left to be sent."""
        return [] if self._line is None or not self._unsent else [self._line]

    def send(self, data: bytes) -> None:
        """Sends the data; keeps for later what cannot be sent now."""
        if self._line is None:
            return
        self._unsent += data
        with contextlib.suppress(BlockingIOError):
            while self._unsent:
                del self._unsent[: self._write(self._line)]
        if len(self._unsent) > UNSENT_LIMIT:
            self.lost += len(self._unsent)
            self._unsent.clear()

    def _write(self, line: int) -> int:
        try:
            return os.write(line, self._unsent)
        except (BrokenPipeError, ConnectionError):
            return len(self._unsent)


class PtyPort(Port):
    """A pseudo-terminal in raw mode, and perhaps a symbolic link to it.

    Its far end is kept open here too, so that it stays raw while hosts come and go. As on a real serial line, nothing
    shows that a host has gone.
    """

    def __init__(self, link: Path | None = None) -> None:
        super().__init__()
        self._link = link
        self._near: int | None = None
        self._far = -1
        self.restore()

    @property
    def url(self) -> str:
        return f"serial://{quote(str(self._link.absolute() if self._link else os.ttyname(self._far)))}"

    @property
    def watched(self) -> list[int]:
        return [] if self._near is None else [self._near]

    @property
    def _line(self) -> int | None:
        return self._near

    def read(self, readable: int) -> bytes:
        with contextlib.suppress(BlockingIOError):
            return os.read(readable, _READ_SIZE)
        return b""

    def cut(self) -> None:
        if self._near is None:
            return
        os.close(self._far)
        os.close(self._near)
        self._near = None
        self._unsent.clear()
        if self._link is not None:
            self._link.unlink(missing_ok=True)

    def restore(self) -> None:
        if self._near is not None:
            return
        near, far = pty.openpty()
        tty.setraw(far)
        os.set_blocking(near, False)
        if self._link is not None:
            try:
                self._replace_link(self._link, os.ttyname(far))
            except OSError as error:
                os.close(near)
                os.close(far)
                raise PortError(f"link: {self._link}: {error.strerror}") from None
        self._near, self._far = near, far

    @staticmethod
    def _replace_link(link: Path, target: str) -> None:
        if link.is_symlink():
            link.unlink()
        link.symlink_to(target)


class TcpPort(Port):
    """A listening TCP port; a second host is rejected while one is connected."""

    def __init__(self, host: str, port: int) -> None:
        super().__init__()
        self._address = (host, port)
        self._listener: socket.socket | None = None
        self._connection: socket.socket | None = None
        self.restore()

    @property
    def url(self) -> str:
        host, port = self._address
        return f"tcp://{host}:{port}"

    @property
    def watched(self) -> list[int]:
        return [each.fileno() for each in (self._listener, self._connection) if each is not None]

    @property
    def _line(self) -> int | None:
        return None if self._connection is None else self._connection.fileno()

    def read(self, readable: int) -> bytes | None:
        if self._listener is not None and readable == self._listener.fileno():
            self._accept(self._listener)
            return b""
        if self._connection is None:
            return b""
        try:
            data = self._connection.recv(_READ_SIZE)
        except BlockingIOError:
            return b""
        except OSError:
            data = b""
        if data:
            return data
        self._hang_up()
        return None

    def _accept(self, listener: socket.socket) -> None:
        if self._connection is not None and select.select([self._connection], [], [], 0)[0]:
            return  # unread input may include the end of the present connection: the next one waits until it is read
        with contextlib.suppress(BlockingIOError, ConnectionError):
            connection, _ = listener.accept()
            if self._connection is not None:
                connection.close()
                return
            connection.setblocking(False)
            connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            self._connection = connection

    def _hang_up(self) -> None:
        if self._connection is not None:
            self._connection.close()
            self._connection = None
        self._unsent.clear()

    def cut(self) -> None:
        self._hang_up()
        if self._listener is not None:
            self._listener.close()
            self._listener = None

    def restore(self) -> None:
        if self._listener is None:
            self._listener = listen_on(*self._address)
            self._address = (self._address[0], self._listener.getsockname()[1])


def listen_on(host: str, port: int) -> socket.socket:
    """Returns a listening non-blocking socket. Raises PortError."""
    try:
        listener = socket.create_server((host, port))
    except OSError as error:
        raise PortError(f"{host}:{port}: {error.strerror}") from None
    listener.setblocking(False)
    return listener


def host_and_port(text: str, option: str) -> tuple[str, int]:
    """Returns host and port of `HOST:PORT`. Raises PortError."""
    host, colon, port = text.rpartition(":")
    if not colon or not host or not port.isdecimal() or int(port) > 65535:
        raise PortError(f"{option}: {text!r}: write HOST:PORT with a port from 0 to 65535")
    return host, int(port)
