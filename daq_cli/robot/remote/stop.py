"""Stops a server's robots: all of them, unless one is named. No other request precedes the stop."""

from __future__ import annotations

import os
import sys

from daq.client import Client
from daq.client.stopping import NoSuchRobot
from daq.contracts.errors import DaqError
from daq.contracts.service.robot import FleetStopResult, StopResult
from daq.owner.stop_socket import StopAnswer
from daq_cli.app.context import Invocation
from daq_cli.robot.remote.connection import TOKEN_VARIABLE

DEFAULT_ROBOT = "ma2000"
NAMES_WITHIN = 1.0
"""Longest wait (s) for a service to list its robots: the person who stops needs the result soon."""


def stop_at_server(call: Invocation) -> list[StopAnswer]:
    """Stops the named robot; without a name, or if the service has no such robot, stops all its robots.

    Never raises: failures are in the answers.
    """
    assert call.server is not None
    name = call.robot_option
    try:
        with Client(call.server, os.environ.get(TOKEN_VARIABLE) or None) as client:
            if name is not None:
                first = client.robot(name).stop()
                if not isinstance(first, NoSuchRobot):
                    return [_answer(name, call.server, first)]
                print(f"{first.note}: {client.url} is asked to stop all of its robots", file=sys.stderr, flush=True)
            found = client.stop()
            if isinstance(found, FleetStopResult):
                return [_answer(one, call.server, result) for one, result in found.robots.items()]
            if isinstance(found, NoSuchRobot):
                return _stop_by_name(call, client)
            return [_answer(_likely_name(call), call.server, found)]
    except DaqError as error:
        return [StopAnswer(robot=name or "all", port=call.server, delivered=False, confirmed=False, text=str(error))]


def _stop_by_name(call: Invocation, client: Client) -> list[StopAnswer]:
    """Stops the robots of a service of version 0.1, which cannot stop all at once: first the one with the likely
    name."""
    assert call.server is not None
    name = _likely_name(call)
    first = client.robot(name).stop()
    others = _others(client, name, first) if isinstance(first, NoSuchRobot) else []
    return [_answer(one, call.server, client.robot(one).stop()) for one in others] or [
        _answer(name, call.server, first)
    ]


def _likely_name(call: Invocation) -> str:
    """Returns the configured name; the default name if the configuration cannot be read, so that the stop is sent
    anyway."""
    try:
        return call.configuration.names[0]
    except DaqError:
        return DEFAULT_ROBOT


def _others(client: Client, name: str, first: StopResult) -> list[str]:
    """Prints that the service has no robot of this name, and returns the names of its robots."""
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
