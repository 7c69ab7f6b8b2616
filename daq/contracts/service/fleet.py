"""All robots of one service at a glance."""

from __future__ import annotations

from pydantic import AwareDatetime

from daq.contracts.service.base import Wire
from daq.contracts.service.queue import Control, QueueStatus
from daq.contracts.service.robot import Activity, ArmState, ConnectionState


class FleetRobot(Wire):
    """Overview of one robot. It contains no data from before a lost connection, and the age of its sample."""

    robot: str
    machine: str
    simulated: bool | None = None
    """Whether it is a mock; None while it is not connected."""
    connection: ConnectionState
    connection_problem: str = ""
    """Why it is not connected."""
    arm: ArmState
    cause: str = ""
    """Why the arm is stopped or at fault."""
    activity: Activity
    limp: tuple[int, ...] = ()
    sample_age: float | None = None
    """Time (s) since the newest sample arrived; None if there is none."""
    progress: float | None = None
    """Progress of the running experiment, from 0 to 1."""
    unattended: bool
    """Whether its queue may move it, a real arm, without an operator who has confirmed being present."""
    control: Control
    queue: QueueStatus


class FleetStatus(Wire):
    """All robots of the service at one moment, in configuration order."""

    utc: AwareDatetime
    robots: tuple[FleetRobot, ...]
