"""Transports bytes to and from a controller: by serial port, pseudo-terminal, TCP, or a mock that it starts itself."""

from daq.transport.channel import ByteChannel, ChannelError, ReconnectDelay
from daq.transport.discovery import FoundPort, ports
from daq.transport.endpoint import Endpoint, open_endpoint
from daq.transport.pseudo_terminal import Terminal, require_same, terminal_at
from daq.transport.url import (
    DriverPort,
    MockPort,
    PortBusyError,
    PortUrl,
    SerialPort,
    TcpPort,
    TransportError,
    parse_port_url,
)

__all__ = [
    "ByteChannel",
    "ChannelError",
    "DriverPort",
    "Endpoint",
    "FoundPort",
    "MockPort",
    "PortBusyError",
    "PortUrl",
    "ReconnectDelay",
    "SerialPort",
    "TcpPort",
    "Terminal",
    "TransportError",
    "open_endpoint",
    "parse_port_url",
    "ports",
    "require_same",
    "terminal_at",
]
