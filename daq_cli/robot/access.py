"""Selects how a command reaches its robot: at a local port, or through a service."""

from __future__ import annotations

import typer

from daq_cli.app.context import Invocation, invocation
from daq_cli.robot.operations import RobotAccess


def robot_access(call: Invocation) -> RobotAccess:
    """Returns the robot at this computer's port, or of the service that the command line names."""
    if call.server is None:
        from daq_cli.robot.local import LocalRobot

        return LocalRobot(call)
    from daq_cli.robot.remote.robot import RemoteRobot

    return RemoteRobot(call, call.server)


def robot_of(context: typer.Context) -> RobotAccess:
    """Returns the robot of this call of `daq`."""
    return robot_access(invocation(context))
