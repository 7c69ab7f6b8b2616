"""The robot of the server that the command line names."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

from daq_cli.app.consent import require_consent
from daq_cli.app.context import Invocation

if TYPE_CHECKING:
    from daq.client import Robot
    from daq.contracts.service.robot import RobotStatus

TOKEN_VARIABLE = "DAQ_TOKEN"


@contextmanager
def remote_robot(call: Invocation) -> Iterator[Robot]:
    """The robot of `call.server`; a service has one. Raises SpecError, ServiceError, ServiceNotReachedError."""
    from daq.client import Client

    assert call.server is not None
    with Client(call.server, os.environ.get(TOKEN_VARIABLE) or None) as client:
        yield client.robot()


def connected_status(robot: Robot) -> RobotStatus:
    """The robot's status, after the service has connected to it. Raises ServiceError when it cannot."""
    status = robot.status()
    return status if status.identity is not None else robot.connect()


def require_word(status: RobotStatus, consent: bool, what: str = "it will move", refused: str = "it moves") -> bool:
    """Whether the robot is a real arm; the operator is asked about one. Raises SafetyError without their word."""
    real = status.identity is not None and not status.identity.simulated
    where = f"{status.robot} at the server ({status.port})"
    require_consent(where, simulated=not real, consent=consent, what=what, refused=refused)
    return real
