"""One way for every command to reach a robot, whichever process owns its port."""

from __future__ import annotations

import typer

from daq_cli.app.context import Invocation, invocation
from daq_cli.robot.operations import RobotAccess


def robot_access(call: Invocation) -> RobotAccess:
    """The robot at this computer's port, or that of the service which the command line names."""
    if call.server is None:
        from daq_cli.robot.local import LocalRobot

        return LocalRobot(call)
    from daq_cli.robot.remote.robot import RemoteRobot

    return RemoteRobot(call, call.server)


def robot_of(context: typer.Context) -> RobotAccess:
    """The robot of this invocation of `daq`."""
    return robot_access(invocation(context))
