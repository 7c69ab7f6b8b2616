"""A stop of a server's robot: it is requested under the robot's likely name, before any other request."""

from __future__ import annotations

import os
import sys

from daq.acquisition.stop_socket import StopAnswer
from daq.client import Client
from daq.client.stopping import NoSuchRobot
from daq.contracts.errors import DaqError
from daq.contracts.service.robot import StopResult
from daq_cli.app.context import Invocation
from daq_cli.robot.remote.connection import TOKEN_VARIABLE

DEFAULT_ROBOT = "ma2000"
NAMES_WITHIN = 1.0
"""Time (s) for a service to name its robots: a person who stops must soon know the result."""


def stop_at_server(call: Invocation) -> list[StopAnswer]:
    """Stops the robot with the configured name; if the service has none of this name, stops all of its robots.

    Never raises: the answers say what is not known.
    """
    assert call.server is not None
    name = _likely_name(call)
    try:
        with Client(call.server, os.environ.get(TOKEN_VARIABLE) or None) as client:
            first = client.robot(name).stop()
            others = _others(client, name, first) if isinstance(first, NoSuchRobot) else []
            return [_answer(one, call.server, client.robot(one).stop()) for one in others] or [
                _answer(name, call.server, first)
            ]
    except DaqError as error:
        return [StopAnswer(robot=name, port=call.server, delivered=False, confirmed=False, text=str(error))]


def _likely_name(call: Invocation) -> str:
    """Returns the configured name; the default name if the configuration cannot be read, so that the stop is sent
    nevertheless."""
    try:
        return call.settings.robot.name
    except DaqError:
        return DEFAULT_ROBOT


def _others(client: Client, name: str, first: StopResult) -> list[str]:
    """Says that the service has no robot of this name, and returns the names of its robots."""
    print(f"{first.note}: {client.url} is asked to stop all of its robots", file=sys.stderr, flush=True)
    try:
        names = [one.robot for one in client.robots(within=NAMES_WITHIN)]
    except DaqError:
        return []
    return [] if name in names else names


def _answer(robot: str, url: str, found: StopResult) -> StopAnswer:
    return StopAnswer(
        robot=robot, port=url, delivered=found.delivered, confirmed=found.confirmed, tick=found.tick, text=found.note
    )
