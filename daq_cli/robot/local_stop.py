"""Stops robots through the configured ports if no process owns them."""

from __future__ import annotations

import os
from concurrent.futures import ThreadPoolExecutor

from daq.contracts.errors import DaqError
from daq.owner.stop_socket import StopAnswer
from daq_cli.app.context import Invocation


def stop_configured(call: Invocation, reached: set[str]) -> list[StopAnswer]:
    """Stops the robots of the command line or the configuration (all of them unless one is named), except those whose
    processes were asked already.

    If the configuration cannot be read, the answer states it; the early stop has reached other robots by then.
    """
    try:
        ports = _ports(call)
    except DaqError as error:
        return [StopAnswer(robot="configured robot", delivered=False, confirmed=False, text=str(error))]
    asked = set(map(_device, reached))
    left = [(name, url) for name, url in ports if not url.startswith("mock://") and _device(url) not in asked]
    if not left:
        return []
    from daq.owner.port_stop import stop_at_port

    with ThreadPoolExecutor(len(left)) as pool:  # a line that does not answer must not delay the stop of other arms
        return list(pool.map(lambda one: stop_at_port(*one), left))


def _ports(call: Invocation) -> list[tuple[str, str]]:
    """Returns names and ports of the robots to stop. Raises SpecError."""
    if call.port_option:
        return [("robot", call.port_option)]
    wanted = call.robot_option
    own = [one.robot for one in call.configuration.each_robot() if wanted in (None, one.robot.name)]
    return [(robot.name, robot.port) for robot in own if robot.port is not None]


def _device(url: str) -> object:
    """Returns the device or address in a port's URL, in any spelling; the text itself if it is not a URL."""
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
