"""Connects to the service named on the command line, and takes control of its robot."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

from daq.contracts.consent import lacks_consent
from daq_cli.app.consent import ConsentPrompt
from daq_cli.app.context import Invocation, console

if TYPE_CHECKING:
    from daq.client import HeldControl, Robot
    from daq.contracts.service.robot import RobotStatus

TOKEN_VARIABLE = "DAQ_TOKEN"


@contextmanager
def remote_robot(call: Invocation) -> Iterator[Robot]:
    """Yields the client of the named or only robot of the service. Raises SpecError, ServiceError,
    ServiceNotReachedError."""
    from daq.client import Client

    assert call.server is not None
    with Client(call.server, os.environ.get(TOKEN_VARIABLE) or None) as client:
        yield client.robot(call.robot_option)


def connected_status(robot: Robot) -> RobotStatus:
    """Connects the service to the robot, and returns the robot's status. Raises ServiceError if that fails."""
    status = robot.status()
    return status if status.identity is not None else robot.connect()


def require_consent(status: RobotStatus, consent: ConsentPrompt) -> bool:
    """Returns whether the robot is a real arm. If it is, asks the operator, and raises SafetyError without consent."""
    consent.require(f"{status.robot} at the server ({status.port})", status.identity)
    return lacks_consent(status.identity, given=False)


@contextmanager
def controlled(call: Invocation, consent: ConsentPrompt) -> Iterator[tuple[Robot, HeldControl]]:
    """Yields the robot, and control of it, which is returned afterwards. For a real arm the operator is asked.

    Raises ServiceError, SafetyError.
    """
    with remote_robot(call) as robot:
        status = connected_status(robot)
        real = require_consent(status, consent)
        with robot.control(moves_real_arm=real) as control:
            yield robot, control
        _say_if_paused(call, robot, status.queue.paused)


def _say_if_paused(call: Invocation, robot: Robot, paused_before: bool) -> None:
    """Prints that the queue is paused: waiting experiments do not begin until a person resumes it."""
    queue = robot.queue.status()
    if queue.paused and not paused_before:
        console().print(f"the queue is paused: {queue.reason}: `daq --server {call.server} queue resume`")
