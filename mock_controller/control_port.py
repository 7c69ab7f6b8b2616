"""The control port's sockets: lines in, lines out, for any number of clients."""

from __future__ import annotations

import socket
from collections.abc import Callable
from pathlib import Path

from mock_controller.ports import PortError, host_and_port, listen_on

_LONGEST_LINE = 65536


class ControlPort:
    """Listens at HOST:PORT or unix:PATH. Raises PortError for an address that cannot be used."""

    def __init__(self, address: str, execute: Callable[[bytes], bytes]) -> None:
        self._execute = execute
        self._path: Path | None = None
        self._clients: dict[int, tuple[socket.socket, bytearray]] = {}
        if address.startswith("unix:"):
            self._path = Path(address.removeprefix("unix:"))
            self._listener = _listen_at(self._path)
            self.url = f"unix://{self._path.absolute()}"
        else:
            host, port = host_and_port(address, "control")
            self._listener = listen_on(host, port)
            self.url = f"tcp://{host}:{self._listener.getsockname()[1]}"

    @property
    def watched(self) -> list[int]:
        """File descriptors to wait on for input."""
        return [self._listener.fileno(), *self._clients]

    def serve(self, readable: int) -> None:
        """Handles a readable descriptor."""
        if readable == self._listener.fileno():
            try:
                client, _ = self._listener.accept()
            except (BlockingIOError, ConnectionError):
                return
            self._clients[client.fileno()] = (client, bytearray())
        elif readable in self._clients:
            self._serve_client(readable)

    def close(self) -> None:
        """Closes everything."""
        for client, _ in self._clients.values():
            client.close()
        self._clients.clear()
        self._listener.close()
        if self._path is not None:
            self._path.unlink(missing_ok=True)

    def _serve_client(self, readable: int) -> None:
        client, buffer = self._clients[readable]
        try:
            data = client.recv(_LONGEST_LINE)
            buffer += data
            *lines, rest = bytes(buffer).split(b"\n")
            buffer[:] = rest
            for line in filter(None, lines):
                client.sendall(self._execute(line))
        except OSError:
            data = b""
        if not data or len(buffer) > _LONGEST_LINE:
            client.close()
            del self._clients[readable]


def _listen_at(path: Path) -> socket.socket:
    listener = socket.socket(socket.AF_UNIX)
    try:
        if path.is_socket():
            path.unlink()
        listener.bind(str(path))
    except OSError as error:
        listener.close()
        raise PortError(f"control: {path}: {error.strerror or error}") from None
    listener.listen()
    listener.setblocking(False)
    return listener
