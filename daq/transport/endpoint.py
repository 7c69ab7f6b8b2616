"""Opens channels from a port URL. An endpoint outlives its channels and can open new ones."""

from __future__ import annotations

import errno
import socket
from typing import Protocol

import serial

from daq.transport.channel import ByteChannel, DescriptorChannel
from daq.transport.embedded_mock import EmbeddedEndpoint
from daq.transport.holders import PROBING_DAEMONS, other_holders
from daq.transport.mock_process import MockProcess, start_mock
from daq.transport.pseudo_terminal import Terminal, require_same, terminal_at
from daq.transport.url import (
    BITS_PER_BYTE,
    DriverPort,
    MockPort,
    PortBusyError,
    PortUrl,
    SerialPort,
    TcpPort,
    TransportError,
    parse_port_url,
)

CONNECT_TIMEOUT_S = 3.0


class Endpoint(Protocol):
    """An address at which a controller is reached."""

    @property
    def url(self) -> str:
        """Port URL as given by the user."""
        ...

    @property
    def lock_step(self) -> bool:
        """Whether the controller's time stands still between requests of the host."""
        ...

    @property
    def bytes_per_second(self) -> float:
        """Capacity of the line in one direction."""
        ...

    @property
    def control(self) -> str | None:
        """URL of the mock's control port, for switching faults; None for all but mock://."""
        ...

    def waited(self) -> float:
        """Time (s) for which the clock of a mock's board has stood still because the mock got no processor time; else
        0."""
        ...

    def connect(self) -> ByteChannel:
        """Opens a new channel. Raises TransportError: one line with the device, the cause, and advice."""
        ...

    def close(self) -> None:
        """Frees what the endpoint owns (a mock's process). May be called twice."""
        ...


def open_endpoint(url: str) -> Endpoint:
    """Returns the endpoint of a URL. Starts a mock; in lock-step without a terminal, in this process. Sends nothing.
    Raises TransportError."""
    port = parse_port_url(url)
    if isinstance(port, MockPort):
        if port.lock_step and not port.through_pty:
            return EmbeddedEndpoint(url, port)
        return MockEndpoint(url, port, start_mock(port, waits=not port.lock_step))
    if isinstance(port, DriverPort):
        raise TransportError(f"{url}: a Python driver has no bytes")
    return PortEndpoint(url, port)


class PortEndpoint:
    """A serial port or a TCP server. It owns nothing between two channels."""

    control: str | None = None

    def __init__(self, url: str, port: SerialPort | TcpPort) -> None:
        self.url = url
        self.lock_step = isinstance(port, TcpPort) and port.lock_step
        self.bytes_per_second = port.baud / BITS_PER_BYTE
        self._port = port
        self._terminal: Terminal | None = None

    def waited(self) -> float:
        """Returns 0: an arm's clock never stands still."""
        return 0.0

    def connect(self) -> ByteChannel:
        """Opens a new channel to the same device as the first."""
        if isinstance(self._port, SerialPort):
            require_same(self._port.device, self._terminal)
            self._terminal = terminal_at(self._port.device) or self._terminal
        return connect(self._port)

    def close(self) -> None:
        """Does nothing."""


class MockEndpoint:
    """A mock's process and the address at which it listens."""

    def __init__(self, url: str, port: MockPort, process: MockProcess) -> None:
        self.url = url
        self.lock_step = port.lock_step
        self.bytes_per_second = port.baud / BITS_PER_BYTE
        self.control = process.control
        self._process = process

    def waited(self) -> float:
        """Returns the time that the mock reports."""
        return self._process.waited()

    def connect(self) -> ByteChannel:
        """Opens a new channel to the same process. Raises TransportError if it has ended."""
        self._process.check_running()
        port = parse_port_url(self._process.url)
        return connect(port)

    def close(self) -> None:
        """Ends the process."""
        self._process.close()


def connect(port: PortUrl) -> ByteChannel:
    """Opens a channel to a serial port or TCP server. Raises TransportError."""
    match port:
        case SerialPort():
            return _connect_serial(port)
        case TcpPort():
            return _connect_tcp(port)
        case MockPort() | DriverPort():
            raise TransportError("a mock is started with open_endpoint and has an address of its own")


def _connect_serial(port: SerialPort) -> ByteChannel:
    try:
        device = serial.Serial(port.device, port.baud, timeout=0, exclusive=True)
    except (serial.SerialException, OSError, ValueError) as error:
        kind = PortBusyError if _is_busy(error) else TransportError
        raise kind(_why_serial_failed(port.device, error)) from error
    device.reset_input_buffer()
    return DescriptorChannel(device.fileno(), port.device, device.close)


def _is_busy(error: Exception) -> bool:
    return getattr(error, "errno", None) == errno.EBUSY or "exclusively lock" in str(error)


def _why_serial_failed(device: str, error: Exception) -> str:
    text = str(error)
    if _is_busy(error):
        line = f"{device} is in use by another program: end that one, or stop the arm with `daq stop` as its user"
        return f"{line}; it is {' and '.join(other_holders(device)) or 'not one of yours: ' + PROBING_DAEMONS}"
    if "No such file" in text:
        return f"{device} does not exist: `daq ports` lists the ports that do"
    if "Permission denied" in text:
        return f"{device} may not be opened by this user: join the group that owns it (often `dialout`)"
    return f"{device} cannot be opened as a serial port: {text}"


def _connect_tcp(port: TcpPort) -> ByteChannel:
    where = f"{port.host}:{port.port}"
    try:
        connection = socket.create_connection((port.host, port.port), CONNECT_TIMEOUT_S)
    except ConnectionRefusedError as error:
        raise TransportError(f"nothing listens at {where}: is the bridge, or the mock, running there?") from error
    except (OSError, UnicodeError) as error:  # an invalid host name raises UnicodeError
        raise TransportError(f"{where} cannot be reached: {error}") from error
    connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    return DescriptorChannel(connection.fileno(), where, connection.close)
