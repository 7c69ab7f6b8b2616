"""A stop through the configured port, for which no process needs to own the port."""

from __future__ import annotations

import os

from daq.acquisition.stop_socket import StopAnswer
from daq.contracts.errors import DaqError
from daq_cli.app.context import Invocation


def stop_configured(call: Invocation, reached: set[str]) -> list[StopAnswer]:
    """Stops the robot of the command line or the configuration, unless the process that owns its port has been asked.

    If the configuration cannot be read, the answer says so; other robots have been stopped by then.
    """
    try:
        url = call.port_option or call.settings.robot.port
        name = "robot" if call.port_option else call.settings.robot.name
    except DaqError as error:
        return [StopAnswer(robot="configured robot", delivered=False, confirmed=False, text=str(error))]
    if url is None or url.startswith("mock://") or _device(url) in map(_device, reached):
        return []
    from daq.acquisition.port_stop import stop_at_port

    return [stop_at_port(name, url)]


def _device(url: str) -> object:
    """Returns the device or address in a port's URL, whatever its spelling; the text itself if it is not a URL."""
    from daq.transport.url import SerialPort, TcpPort, TransportError, parse_port_url

    try:
        port = parse_port_url(url)
    except TransportError:
        return url
    match port:
        case SerialPort(device):
            return os.path.realpath(device)
        case TcpPort(host, number):
            return host.lower(), number
    return url
